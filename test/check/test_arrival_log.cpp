#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../../src/check/arrival_log.hpp"
#include "../said.hpp"

namespace sdvo::test_arrival_log {

std::int64_t nanoseconds(double seconds) {
  return std::llround(1e9 * seconds);
}

class ArrivalLogTest : public ::testing::Test {
 protected:
  explicit ArrivalLogTest(bool approximate = false) : log_(options(approximate), unused_) {
    log_.begin({"/l/image", "/r/image", "/l/info", "/r/info"}, 0.0);
  }

  static StereoInputOptions options(bool approximate) {
    StereoInputOptions options;
    options.pairing.approximate_sync = approximate;
    return options;
  }

  void note(ArrivalLog::Input input, double stamp, double now) { log_.note(input, nanoseconds(stamp), now); }

  void noteAll(double stamp, double now) {
    for (const auto input :
         {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kLeftInfo, ArrivalLog::kRightInfo})
      note(input, stamp, now);
  }

  void noteUsed(double stamp, double now) {
    noteAll(stamp, now);
    const std::int64_t ns = nanoseconds(stamp);
    log_.notePair(ns, ns, now);
  }

  std::uint64_t unpaired() const { return unused_.count(UnusedInput::kUnpaired); }

  UnusedInput unused_{"pairs", 0.05};
  ArrivalLog log_;
};

TEST_F(ArrivalLogTest, SaysNothingOfAHealthyStream) {
  for (int i = 0; i < 300; ++i) {
    noteUsed(100.0 + 0.05 * i, 0.05 * i);
    EXPECT_EQ(log_.explainLoss(0.05 * i), "");
    EXPECT_EQ(log_.explainSilence(0.05 * i), "");
  }
  EXPECT_EQ(unpaired(), 0u);
  Values values;
  EXPECT_EQ(log_.checkPairs(15.0, 0.005, values).verdict, Verdict::kOk);
  ASSERT_EQ(values.all().size(), 5u);
  for (std::size_t input = 1; input < values.all().size(); ++input) {
    const auto& [topic, rate] = values.all()[input];
    EXPECT_NEAR(std::stod(rate), 20.0, 0.5) << topic;
  }
}

TEST_F(ArrivalLogTest, AnAccidentIsCountedAndNotSaid) {
  for (int i = 0; i < 100; ++i) {
    if (i == 50)
      note(ArrivalLog::kLeftImage, 100.0 + 0.05 * i, 0.05 * i);
    else
      noteUsed(100.0 + 0.05 * i, 0.05 * i);
    EXPECT_EQ(log_.explainLoss(0.05 * i), "");
  }
  EXPECT_EQ(unpaired(), 1u);
}

TEST_F(ArrivalLogTest, CameraInfoThatIsSlowerThanTheImagesIsNamedWithItsRate) {
  for (int i = 0; i < 200; ++i) {
    const double stamp = 100.0 + 0.05 * i, now = 0.05 * i;
    if (i % 20 == 0) {
      noteUsed(stamp, now);
      continue;
    }
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kRightInfo})
      note(input, stamp, now);
  }
  const std::string loss = log_.explainLoss(10.0);
  expectWords(loss,
              {"; /l/info must have a message for each image", "/l/image 100 /r/image 100 /l/info 5 /r/info 100"});
  log_.explainLoss(20.0);  // what waits for partners is given up
  EXPECT_EQ(unpaired(), 190u);
}

/// The subscribers do not connect at once.
TEST_F(ArrivalLogTest, ImagesFromBeforeAllTopicsWereThereAreNotCounted) {
  for (int i = 0; i < 10; ++i) note(ArrivalLog::kLeftImage, 100.0 + 0.05 * i, 0.05 * i);
  for (int i = 5; i < 12; ++i) note(ArrivalLog::kRightImage, 100.0 + 0.05 * i, 0.05 * i);
  for (int i = 12; i < 60; ++i) noteUsed(100.0 + 0.05 * i, 0.05 * i);
  EXPECT_EQ(log_.explainLoss(3.0), "");
  EXPECT_EQ(unpaired(), 0u);
}

TEST_F(ArrivalLogTest, SilenceIsExplainedByWhatArrived) {
  EXPECT_EQ(log_.explainSilence(9.0), "") << "it has just begun";
  note(ArrivalLog::kLeftImage, 1.0, 10.0);
  note(ArrivalLog::kLeftImage, 2.0, 10.5);
  note(ArrivalLog::kRightInfo, 3.0, 11.0);
  note(ArrivalLog::kRightInfo, 0.0, 11.0);
  EXPECT_EQ(log_.explainSilence(11.0),
            "no synchronised stereo pair; received: /l/image 2 /r/image 0 /l/info 0 /r/info 2 (1 with zero stamps)");
  EXPECT_EQ(log_.explainLoss(11.0), "");
}

TEST_F(ArrivalLogTest, TheEndOfARecordingIsSaidOnceAndItsNextStartAnew) {
  for (const double begin : {20.0, 60.0}) {
    noteUsed(begin, begin);
    EXPECT_EQ(log_.explainSilence(begin + 9.0), "");
    EXPECT_EQ(log_.explainSilence(begin + 11.0), "no message of the camera for 10 s: it has ended");
    EXPECT_EQ(log_.explainSilence(begin + 16.0), "");
  }
  note(ArrivalLog::kLeftImage, 80.0, 80.0);
  EXPECT_TRUE(contains(log_.explainSilence(81.0), "no synchronised stereo pair")) << "one side alone has not ended";
}

TEST_F(ArrivalLogTest, ExtremeStampsAreCompared) {
  noteAll(1.0, 10.0);
  log_.note(ArrivalLog::kLeftImage, std::numeric_limits<std::uint32_t>::max() * 1'000'000'000LL + 999'999'999, 10.0);
  log_.note(ArrivalLog::kRightImage, 1, 10.0);
  EXPECT_TRUE(contains(log_.explainSilence(11.0), "no synchronised stereo pair"));
}

TEST_F(ArrivalLogTest, OneSideThatIsLateAsksForALongerQueue) {
  // 32 Hz, equal stamps; the right camera's messages come 0.75 s later: 24 periods.
  for (int i = 0; i < 400; ++i) {
    const double stamp = 10.0 + i / 32.0, late = stamp - 0.75;
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kLeftInfo}) note(input, stamp, i / 32.0);
    for (const auto input : {ArrivalLog::kRightImage, ArrivalLog::kRightInfo}) note(input, late, i / 32.0);
  }
  const std::string text = log_.explainLoss(400 / 32.0);
  EXPECT_TRUE(contains(text, "0.75 s apart: set sync_queue_size, now 20, to at least 26")) << text;
  EXPECT_FALSE(contains(text, "approximate_sync")) << text;
}

struct ApproximateArrivalLogTest : ArrivalLogTest {
  ApproximateArrivalLogTest() : ArrivalLogTest(true) {}
};

TEST_F(ApproximateArrivalLogTest, DoesNotAdviseWhatIsSetAlready) {
  for (int i = 0; i < 100; ++i) {
    note(ArrivalLog::kLeftImage, 10.0 + 0.1 * i, 0.1 * i);
    note(ArrivalLog::kRightImage, 10.04 + 0.1 * i, 0.1 * i);
  }
  const std::string text = log_.explainSilence(10.0);
  EXPECT_TRUE(contains(text, "40.0 to 40.0 ms apart, more than max_interval (25.0 ms)")) << text;
  EXPECT_FALSE(contains(text, "approximate_sync")) << text;
}

/// Of a whole recording.
class RecordedArrivals : public ::testing::Test {
 protected:
  static constexpr double kBegin = 1.7e9, kPeriod = 0.05;  // s

  RecordedArrivals() { log_.begin({"/left", "/right", "/left_info", "/right_info"}, 0.0); }

  void note(int input, double stamp, double now) {
    log_.note(static_cast<ArrivalLog::Input>(input), nanoseconds(stamp), now);
  }

  /// `count` pairs, which arrive 20 ms after their time, with stamps of another clock.
  void notePairs(int count, double clock = 0.0, int every = 0, double begin = kBegin) {
    for (int i = 0; i < count; ++i) {
      if (every > 0 && i % every == 0) continue;
      const double time = begin + i * kPeriod, now = time + 0.02;
      for (int input = 0; input < ArrivalLog::kInputs; ++input) note(input, time + clock, now);
      const std::int64_t stamp = nanoseconds(time + clock);
      log_.notePair(stamp, stamp, now);
    }
  }

  static void expectFinding(const Finding& finding, Verdict verdict, const std::string& words) {
    EXPECT_EQ(finding.verdict, verdict) << finding.text();
    EXPECT_TRUE(contains(finding.text(), words)) << finding.text();
  }

  UnusedInput unused_{"pairs", 1.0};
  StereoInputOptions options_;
  ArrivalLog log_{options_, unused_, std::numeric_limits<double>::infinity()};
};

TEST_F(RecordedArrivals, SteadyPairsAreInOrderHoweverLongTheRecording) {
  notePairs(4000);
  EXPECT_NEAR(log_.pairRate(), 20.0, 1e-3);
  expectFinding(log_.checkTopics(), Verdict::kOk, "4000 pairs, 20.0 Hz");
  expectFinding(log_.checkStamps(), Verdict::kOk, "longest gap 50.0 ms, 0.0 % without partner");
}

TEST_F(RecordedArrivals, TheTopicOnWhichNothingComesIsNamed) {
  for (const int input : {0, 1, 2}) note(input, kBegin, kBegin);
  expectFinding(log_.checkTopics(), Verdict::kFail, "/right_info");
}

TEST_F(RecordedArrivals, TheCauseOfNoPairIsNamed) {
  for (const int input : {0, 1, 2, 3}) note(input, kBegin + input, kBegin);
  expectFinding(log_.checkTopics(), Verdict::kFail, "no synchronised stereo pair; received: /left 1");
}

TEST_F(RecordedArrivals, ARateBeyondWhatSuits) {
  for (int i = 0; i < 4; ++i) notePairs(1, 0.0, 0, kBegin + i);
  expectFinding(log_.checkTopics(), Verdict::kWarn, "4 pairs, 1.0 Hz");
}

TEST_F(RecordedArrivals, AnotherClock) {
  notePairs(40, -1.6e9);
  expectFinding(log_.checkStamps(), Verdict::kWarn, "another clock");
}

TEST_F(RecordedArrivals, MissingPairs) {
  notePairs(60, 0.0, 10);
  expectFinding(log_.checkStamps(), Verdict::kWarn, "missing");
}

TEST_F(RecordedArrivals, ImagesWithoutPartner) {
  notePairs(40);
  for (int i = 1; i < 5; ++i) note(0, kBegin + 0.001 * i, kBegin + 2.0);
  expectFinding(log_.checkStamps(), Verdict::kWarn, "set sync_tolerance to 0.005");
}

TEST_F(RecordedArrivals, StampsThatFall) {
  notePairs(40);
  notePairs(1);
  expectFinding(log_.checkStamps(), Verdict::kWarn, "fall");
}

TEST_F(RecordedArrivals, OnePairIsTooFew) {
  notePairs(1);
  expectFinding(log_.checkTopics(), Verdict::kOpen, "one pair alone");
  expectFinding(log_.checkStamps(), Verdict::kOpen, "no pairs");
}

}  // namespace sdvo::test_arrival_log
