#include <gtest/gtest.h>

#include <limits>

#include "../../src/common/stamp_filter.hpp"

namespace sdvo::test_stamp_filter {

using Passed = std::vector<std::pair<int, int>>;

/// A stamp that arrives, and the items that pass then: (running number, restarts of the source so far).
struct Step {
  double stamp, now;  ///< s
  Passed passed;
  int clock_steps = 0;  ///< of the last item passed so far
  bool announced = false;
};

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

TEST(StampFilter, PassesWhatGoesOnAndTellsJumpsFromOutliers) {
  const struct {
    const char* what;
    std::vector<Step> steps;
    std::uint64_t dropped;
  } streams[] = {
      {"in order", {{100.0, 50.0, {{0, 0}}}, {100.1, 50.0, {{1, 0}}}, {101.1, 50.0, {{2, 0}}}}, 0},
      {"slow ones wait for nothing", {{100.0, 7.0, {{0, 0}}}, {103.0, 10.0, {{1, 0}}}, {106.0, 13.0, {{2, 0}}}}, 0},
      {"late, or the same",
       {{100.0, 50.0, {{0, 0}}}, {100.1, 50.1, {{1, 0}}}, {100.1, 50.2, {}}, {99.2, 50.3, {}}, {100.2, 50.4, {{4, 0}}}},
       2},
      {"single outliers to either side",
       {{100.0, 50.0, {{0, 0}}},
        {70.0, 50.1, {}},
        {100.2, 50.2, {{2, 0}}},
        {0.1, 50.1, {}},
        {100.4, 50.2, {{4, 0}}},
        {130.0, 50.1, {}},
        {100.6, 50.2, {{6, 0}}},
        {4e9, 50.1, {}},
        {100.8, 50.2, {{8, 0}}}},
       4},
      {"outliers one after the other",
       {{100.0, 50.0, {{0, 0}}}, {70.0, 50.0, {}}, {20.0, 50.0, {}}, {900.0, 50.0, {}}, {100.1, 50.0, {{4, 0}}}},
       3},
      {"a lasting jump back is a restart of the source and loses nothing",
       {{100.0, 50.0, {{0, 0}}}, {70.0, 50.1, {}}, {70.1, 50.2, {{1, 1}, {2, 1}}}, {70.2, 50.3, {{3, 1}}}},
       0},
      {"a lasting jump ahead is no restart",
       {{100.0, 50.0, {{0, 0}}}, {130.0, 50.1, {}}, {130.1, 50.2, {{1, 0}, {2, 0}}}},
       0},
      {"a jump that the source announces is believed at once",
       {{100.0, 50.0, {{0, 0}}}, {70.0, 50.1, {{1, 1}}, 0, true}, {90.0, 50.2, {{2, 1}}, 0, true}},
       0},
      {"a jump that the clock made is believed at once and counted by itself",
       {{100.0, 100.0, {{0, 0}}},
        {160.0, 160.0, {{1, 0}}},     // a pause
        {100.0, 100.0, {{2, 0}}, 1},  // a bag that starts again, or a system's clock set back
        {100.5, 100.5, {{3, 0}}, 1},
        {100.0, 100.0, {{4, 0}}, 2}},  // a bag shorter than a second
       0},
      {"a small step of the clock has no part in a jump much later",
       {{100.0, 100.0, {{0, 0}}},
        {100.1, 99.9, {{1, 0}}},
        {100.2, 100.0, {{2, 0}}},
        {100.9, 100.7, {{3, 0}}},
        {101.8, 101.6, {{4, 0}}},
        {50.0, 101.7, {}},
        {50.1, 101.8, {{5, 1}, {6, 1}}}},
       0},
      {"a jump of the clock is known whether it or the item comes first",
       {{160.0, 160.0, {{0, 0}}},
        {100.0, 160.0, {}},  // before the clock
        {100.1, 100.1, {{1, 0}, {2, 0}}, 1},
        {100.2, 50.0, {{3, 0}}, 1},  // of before, after the clock
        {50.0, 50.1, {}, 1},
        {50.1, 50.2, {{4, 0}, {5, 0}}, 2},
        {10.0, 50.3, {}, 2},
        {10.1, 50.4, {{6, 1}, {7, 1}}, 2}},  // the source alone
       0},
  };
  for (const auto& stream : streams) {
    StampFilter<int> filter;
    int next = 0, clock_steps = 0;
    for (const Step& step : stream.steps) {
      SCOPED_TRACE(stream.what + std::string(", item ") + std::to_string(next));
      Passed passed;
      for (const auto& item : filter.add(next, nanoseconds(step.stamp), nanoseconds(step.now), step.announced))
        passed.emplace_back(item.item, item.source_restarts), clock_steps = item.clock_steps;
      EXPECT_EQ(passed, step.passed);
      EXPECT_EQ(clock_steps, step.clock_steps);
      ++next;
    }
    EXPECT_EQ(filter.dropped(), stream.dropped) << stream.what;
  }
}

TEST(StampFilter, SurvivesEveryStamp) {
  StampFilter<int> filter;
  const std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  for (const std::uint32_t stamp : {0u, most, 1u << 31, 1u, most - 1, 0u, most})
    for (const std::uint32_t now : {0u, most}) filter.add(0, nanoseconds(stamp), nanoseconds(now), false);
  filter.add(1, nanoseconds(100.0), nanoseconds(50.0), false);
  const auto next = filter.add(2, nanoseconds(100.1), nanoseconds(50.0), false);
  ASSERT_FALSE(next.empty());
  EXPECT_EQ(next.back().item, 2);
}

}  // namespace sdvo::test_stamp_filter
