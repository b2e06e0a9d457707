#include <gtest/gtest.h>

#include <cmath>

#include "../../src/check/stamp_check.hpp"
#include "../said.hpp"

namespace sdvo::test_stamp_check {

constexpr std::int64_t kPeriod = 50000000;  // ns, 20 Hz
constexpr std::int64_t kBegin = 1700000000000000000;

/// `pairs` of 20 Hz on all four topics, which arrive 20 ms after their stamps.
StampCheck recording(int pairs, std::int64_t clock = 0, int every = 1) {
  StampCheck check({"/left", "/right", "/left_info", "/right_info"});
  for (int i = 0; i < pairs; ++i) {
    if (every > 1 && i % every == 0) continue;
    const std::int64_t stamp = kBegin + i * kPeriod;
    for (std::size_t input = 0; input < StampCheck::kInputs; ++input)
      check.note(input, stamp + clock, 1e-9 * static_cast<double>(stamp) + 0.02);
    check.notePair(stamp + clock);
  }
  return check;
}

void expectSaid(const Finding& finding, Verdict verdict, const std::string& words) {
  EXPECT_EQ(finding.verdict, verdict) << finding.what;
  EXPECT_TRUE(contains((finding.what + finding.remedy), words)) << finding.what << "; " << finding.remedy;
}

TEST(StampCheck, SteadyPairsAreInOrder) {
  const StampCheck check = recording(40);
  EXPECT_NEAR(check.rate(), 20.0, 1e-9);
  EXPECT_EQ(check.topics(4.5, 66.0, "").verdict, Verdict::kOk);
  EXPECT_EQ(check.stamps().verdict, Verdict::kOk);
}

TEST(StampCheck, NamesTheTopicOnWhichNothingComes) {
  StampCheck check({"/left", "/right", "/left_info", "/right_info"});
  for (const std::size_t input : {0, 1, 2}) check.note(input, kBegin, 1.7e9);
  expectSaid(check.topics(4.5, 66.0, ""), Verdict::kFail, "/right_info");
}

TEST(StampCheck, ExplainsWhyNoPairComesTogether) {
  StampCheck check({"/left", "/right", "/left_info", "/right_info"});
  for (std::size_t input = 0; input < StampCheck::kInputs; ++input) check.note(input, kBegin, 1.7e9);
  expectSaid(check.topics(4.5, 66.0, "the cause"), Verdict::kFail, "the cause");
}

TEST(StampCheck, WarnsOfARateBeyondWhatSuits) {
  expectSaid(recording(40).topics(30.0, 66.0, ""), Verdict::kWarn, "20.0 Hz");
}

TEST(StampCheck, WarnsOfAnotherClock) {
  expectSaid(recording(40, -1600000000000000000).stamps(), Verdict::kWarn, "another clock");
}

TEST(StampCheck, WarnsOfMissingPairs) {
  expectSaid(recording(60, 0, 10).stamps(), Verdict::kWarn, "missing");
}

TEST(StampCheck, WarnsOfImagesWithoutPartner) {
  StampCheck check = recording(40);
  for (int i = 0; i < 4; ++i) check.note(0, kBegin + i, 1.7e9);
  expectSaid(check.stamps(), Verdict::kWarn, "partner");
}

TEST(StampCheck, WarnsOfStampsThatFall) {
  StampCheck check = recording(40);
  check.notePair(kBegin);
  expectSaid(check.stamps(), Verdict::kWarn, "fall");
}

TEST(StampCheck, JudgesNoStampsWithoutPairs) {
  EXPECT_EQ(recording(1).stamps().verdict, Verdict::kOpen);
}

TEST(CheckLatency, StampsOfTheFutureAndThePastAndSinceBoot) {
  for (const double latency : {-0.05, 0.0, 0.3}) EXPECT_EQ(checkLatency(latency, 0.5).verdict, Verdict::kOk) << latency;
  expectSaid(checkLatency(0.6, 0.5), Verdict::kWarn, "0.600 s from image to poseis the machine too slow");
  for (const double latency : {-0.3, -5.0}) expectSaid(checkLatency(latency, 0.5), Verdict::kWarn, "in the future");
  expectSaid(checkLatency(std::nan(""), 0.5), Verdict::kWarn, "--clock");
  expectSaid(checkLatency(1795739520.0, 0.5), Verdict::kWarn, "another clock than this machine");
  EXPECT_FALSE(contains(checkLatency(1795739520.0, 0.5).text(), "too slow"));
}

}  // namespace sdvo::test_stamp_check
