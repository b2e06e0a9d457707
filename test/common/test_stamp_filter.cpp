#include <gtest/gtest.h>

#include <limits>

#include "../../src/common/stamp_filter.hpp"

namespace sdvo::test_stamp_filter {

constexpr std::int64_t kSecond = 1000000000;

/// A stream whose items are their own running numbers.
class StampFilterTest : public ::testing::Test {
 protected:
  /// Items passed on, with the restarts of their source. Times in s.
  std::vector<std::pair<int, int>> add(double stamp, double now, bool announced = false) {
    std::vector<std::pair<int, int>> passed;
    for (const auto& item : filter_.add(next_++, toNanoseconds(stamp), toNanoseconds(now), announced))
      passed.emplace_back(item.item, item.source_restarts), clock_steps_ = item.clock_steps;
    return passed;
  }

  static std::int64_t toNanoseconds(double seconds) {
    return static_cast<std::int64_t>(seconds * static_cast<double>(kSecond));
  }

  using Passed = std::vector<std::pair<int, int>>;
  StampFilter<int> filter_;
  int next_ = 0;
  int clock_steps_ = 0;  // of the last item passed
};

TEST_F(StampFilterTest, PassesWhatComesInOrder) {
  EXPECT_EQ(add(100.0, 50.0), (Passed{{0, 0}}));
  EXPECT_EQ(add(100.1, 50.0), (Passed{{1, 0}}));
  EXPECT_EQ(add(101.1, 50.0), (Passed{{2, 0}}));
  EXPECT_EQ(filter_.dropped(), 0u);
}

TEST_F(StampFilterTest, DropsWhatIsLateOrTheSame) {
  add(100.0, 50.0);
  add(100.1, 50.1);
  EXPECT_EQ(add(100.1, 50.2), Passed{});
  EXPECT_EQ(add(99.2, 50.3), Passed{});
  EXPECT_EQ(filter_.dropped(), 2u);
  EXPECT_EQ(add(100.2, 50.4), (Passed{{4, 0}}));
}

TEST_F(StampFilterTest, ASingleOutlierToEitherSideIsDropped) {
  add(100.0, 50.0);
  for (const double outlier : {70.0, 0.1, 130.0, 4e9}) {
    SCOPED_TRACE(outlier);
    const std::uint64_t dropped = filter_.dropped();
    EXPECT_EQ(add(outlier, 50.1), Passed{});
    const Passed next = add(100.0 + 0.1 * next_, 50.2);
    EXPECT_EQ(next, (Passed{{next_ - 1, 0}}));
    EXPECT_EQ(filter_.dropped(), dropped + 1);
  }
}

TEST_F(StampFilterTest, OutliersOneAfterTheOtherAreDropped) {
  add(100.0, 50.0);
  EXPECT_EQ(add(70.0, 50.0), Passed{});
  EXPECT_EQ(add(20.0, 50.0), Passed{});
  EXPECT_EQ(add(900.0, 50.0), Passed{});
  EXPECT_EQ(add(100.1, 50.0), (Passed{{4, 0}}));
  EXPECT_EQ(filter_.dropped(), 3u);
}

TEST_F(StampFilterTest, ALastingJumpBackIsARestartOfTheSourceAndLosesNothing) {
  add(100.0, 50.0);
  EXPECT_EQ(add(70.0, 50.1), Passed{});
  EXPECT_EQ(add(70.1, 50.2), (Passed{{1, 1}, {2, 1}}));
  EXPECT_EQ(add(70.2, 50.3), (Passed{{3, 1}}));
  EXPECT_EQ(filter_.dropped(), 0u);
}

TEST_F(StampFilterTest, ALastingJumpAheadIsNoRestart) {
  add(100.0, 50.0);
  EXPECT_EQ(add(130.0, 50.1), Passed{});
  EXPECT_EQ(add(130.1, 50.2), (Passed{{1, 0}, {2, 0}}));
}

TEST_F(StampFilterTest, AJumpThatTheClockMadeIsBelievedAtOnceAndCountedByItself) {
  add(100.0, 100.0);
  add(160.0, 160.0);  // a pause
  EXPECT_EQ(clock_steps_, 0);
  EXPECT_EQ(add(100.0, 100.0), (Passed{{2, 0}}));  // a bag that starts again, or a system's clock set back
  EXPECT_EQ(clock_steps_, 1);
  EXPECT_EQ(add(100.5, 100.5), (Passed{{3, 0}}));
  EXPECT_EQ(clock_steps_, 1);
  EXPECT_EQ(add(100.0, 100.0), (Passed{{4, 0}}));  // a bag shorter than a second
  EXPECT_EQ(clock_steps_, 2);
  EXPECT_EQ(filter_.dropped(), 0u);
}

TEST_F(StampFilterTest, ASmallStepOfTheClockHasNoPartInAJumpMuchLater) {
  add(100.0, 100.0);
  add(100.1, 99.9);
  add(100.2, 100.0), add(100.9, 100.7), add(101.8, 101.6);
  EXPECT_EQ(add(50.0, 101.7), Passed{});
  EXPECT_EQ(add(50.1, 101.8), (Passed{{5, 1}, {6, 1}})) << "the source alone";
  EXPECT_EQ(clock_steps_, 0);
}

TEST_F(StampFilterTest, AJumpOfTheClockIsKnownWhetherItOrTheItemComesFirst) {
  add(160.0, 160.0);
  EXPECT_EQ(add(100.0, 160.0), Passed{});  // before the clock
  EXPECT_EQ(add(100.1, 100.1), (Passed{{1, 0}, {2, 0}}));
  EXPECT_EQ(clock_steps_, 1);
  EXPECT_EQ(add(100.2, 50.0), (Passed{{3, 0}}));  // of before, after the clock
  EXPECT_EQ(add(50.0, 50.1), Passed{});
  EXPECT_EQ(add(50.1, 50.2), (Passed{{4, 0}, {5, 0}}));
  EXPECT_EQ(clock_steps_, 2);
  EXPECT_EQ(add(10.0, 50.3), Passed{});
  EXPECT_EQ(add(10.1, 50.4), (Passed{{6, 1}, {7, 1}}));  // the source alone
  EXPECT_EQ(clock_steps_, 2);
}

TEST_F(StampFilterTest, AJumpThatTheSourceAnnouncesIsBelievedAtOnce) {
  add(100.0, 50.0);
  EXPECT_EQ(add(70.0, 50.1, true), (Passed{{1, 1}}));
  EXPECT_EQ(add(90.0, 50.2, true), (Passed{{2, 1}}));
}

TEST_F(StampFilterTest, SlowStreamsWaitForNothing) {
  for (int i = 0; i < 5; ++i) EXPECT_EQ(add(100.0 + 3.0 * i, 7.0 + 3.0 * i), (Passed{{i, 0}}));
}

TEST_F(StampFilterTest, SurvivesEveryStamp) {
  const std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  for (const std::uint32_t stamp : {0u, most, 1u << 31, 1u, most - 1, 0u, most})
    for (const std::uint32_t now : {0u, most}) add(stamp, now);
  add(100.0, 50.0);
  const Passed next = add(100.1, 50.0);
  ASSERT_FALSE(next.empty());
  EXPECT_EQ(next.back().first, next_ - 1);
}

}  // namespace sdvo::test_stamp_filter
