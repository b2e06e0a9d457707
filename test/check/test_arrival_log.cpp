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

TEST_F(ArrivalLogTest, LostImagesOfEitherSideAreNamed) {
  const auto lose = [&](int begin, ArrivalLog::Input lost, int every) {
    for (int i = begin; i < begin + 120; ++i) {
      const double stamp = 100.0 + 0.05 * i, now = 0.05 * i;
      if (i % every != 1) {
        noteUsed(stamp, now);
        continue;
      }
      for (const auto input :
           {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kLeftInfo, ArrivalLog::kRightInfo})
        if (input != lost) note(input, stamp, now);
    }
    return log_.explainLoss(0.05 * (begin + 119));
  };
  expectWords(lose(0, ArrivalLog::kRightImage, 3), {"left images have no right one within half a period"});
  expectWords(lose(120, ArrivalLog::kLeftImage, 2), {"right images have no left one within half a period"});
  log_.explainLoss(22.0);  // what waits for partners is given up
  EXPECT_EQ(unpaired(), 40u + 60u);
}

/// Stamps of free-running cameras.
TEST_F(ArrivalLogTest, TheSpreadOfStampsThatDifferIsSaid) {
  for (int i = 0; i < 100; ++i) {
    const double stamp = 100.0 + 0.05 * i, apart = 1e-3 * (i % 9 - 4);
    if (std::abs(apart) < 1.5e-3) {
      noteUsed(stamp, 0.05 * i);
      continue;
    }
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kLeftInfo}) note(input, stamp, 0.05 * i);
    for (const auto input : {ArrivalLog::kRightImage, ArrivalLog::kRightInfo}) note(input, stamp + apart, 0.05 * i);
  }
  expectWords(log_.explainLoss(5.0), {"stereo pairs in 5 s are not used", "the nearest stamps of left and right are 2.",
                                      "ms apart, more than sync_tolerance (1.0 ms): set sync_tolerance to 0.0"});
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

constexpr double kBegin = 1.7e9;  // s

/// Of a whole recording.
struct RecordedArrivals {
  RecordedArrivals() { log.begin({"/left", "/right", "/left_info", "/right_info"}, 0.0); }

  void note(int input, double stamp, double now) {
    log.note(static_cast<ArrivalLog::Input>(input), nanoseconds(stamp), now);
  }

  /// One message each, `apart` s.
  void note(const std::vector<int>& inputs, double apart) {
    for (const int input : inputs) note(input, kBegin + apart * input, kBegin);
  }

  /// `count` pairs, which arrive 20 ms after their time, with stamps of another clock.
  void notePairs(int count, double clock = 0.0, int every = 0, double begin = kBegin) {
    for (int i = 0; i < count; ++i) {
      if (every > 0 && i % every == 0) continue;
      const double time = begin + i * 0.05, now = time + 0.02;
      for (int input = 0; input < ArrivalLog::kInputs; ++input) note(input, time + clock, now);
      const std::int64_t stamp = nanoseconds(time + clock);
      log.notePair(stamp, stamp, now);
    }
  }

  UnusedInput unused{"pairs", 1.0};
  StereoInputOptions options;
  ArrivalLog log{options, unused, std::numeric_limits<double>::infinity()};
};

void expectFinding(const Finding& finding, Verdict verdict, const std::string& words) {
  EXPECT_EQ(finding.verdict, verdict) << finding.text();
  expectWords(finding.text(), {words});
}

TEST(ArrivalLog, FindingsOfARecordingNameItsFault) {
  const struct {
    std::function<void(RecordedArrivals&)> arrivals;
    Verdict of_topics, of_stamps;
    std::string topics, stamps;
  } cases[] = {
      {[](auto& of) { of.notePairs(4000); }, Verdict::kOk, Verdict::kOk, "4000 pairs, 20.0 Hz",
       "longest gap 50.0 ms, 0.0 % without partner"},
      {[](auto& of) { of.notePairs(1); }, Verdict::kOpen, Verdict::kOpen, "one pair alone", "no pairs"},
      {[](auto& of) {
         of.note({0, 1, 2}, 0.0);
       },
       Verdict::kFail, Verdict::kOpen, "/right_info", ""},
      {[](auto& of) {
         of.note({0, 1, 2, 3}, 1.0);
       },
       Verdict::kFail, Verdict::kOpen, "no synchronised stereo pair; received: /left 1", ""},
      {[](auto& of) {
         for (int i = 0; i < 4; ++i) of.notePairs(1, 0.0, 0, kBegin + i);
       },
       Verdict::kWarn, Verdict::kOk, "4 pairs, 1.0 Hz", ""},
      {[](auto& of) { of.notePairs(40, -1.6e9); }, Verdict::kOk, Verdict::kWarn, "", "another clock"},
      {[](auto& of) { of.notePairs(60, 0.0, 10); }, Verdict::kOk, Verdict::kWarn, "", "missing"},
      {[](auto& of) {
         of.notePairs(40);
         for (int i = 1; i < 5; ++i) of.note(0, kBegin + 0.001 * i, kBegin + 2.0);
       },
       Verdict::kOk, Verdict::kWarn, "", "set sync_tolerance to 0.005"},
      {[](auto& of) { of.notePairs(40), of.notePairs(1); }, Verdict::kOk, Verdict::kWarn, "", "fall"},
  };
  for (const auto& c : cases) {
    RecordedArrivals recorded;
    c.arrivals(recorded);
    expectFinding(recorded.log.checkTopics(), c.of_topics, c.topics);
    expectFinding(recorded.log.checkStamps(), c.of_stamps, c.stamps);
  }
}

}  // namespace sdvo::test_arrival_log
