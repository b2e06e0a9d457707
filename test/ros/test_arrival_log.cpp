#include <gtest/gtest.h>

#include <string>

#include "../../src/ros/arrival_log.hpp"
#include "message_samples.hpp"

namespace sdvo {
namespace test_arrival_log {

using ros_conversions::contains;

class ArrivalLogTest : public ::testing::Test {
 protected:
  explicit ArrivalLogTest(bool approximate = false) : log_(topics(), options(approximate)) {}

  static std::array<std::string, ArrivalLog::kInputs> topics() {
    return {"/l/image", "/r/image", "/l/info", "/r/info"};
  }
  static StereoInputOptions options(bool approximate) {
    StereoInputOptions options;
    options.approximate_sync = approximate;
    return options;
  }

  void note(ArrivalLog::Input input, double stamp, double now) { log_.note(input, ros::Time(stamp), now); }

  ArrivalLog log_;
};

TEST_F(ArrivalLogTest, SaysNothingWhilePairsCome) {
  note(ArrivalLog::kLeftImage, 1.0, 0.0);
  log_.notePair();
  EXPECT_EQ(log_.explainSilence(), "");
  EXPECT_NE(log_.explainSilence(), "");  // none since
}

TEST_F(ArrivalLogTest, CountsWhatArrivedSinceTheLastTime) {
  note(ArrivalLog::kLeftImage, 1.0, 0.0);
  note(ArrivalLog::kLeftImage, 2.0, 0.0);
  note(ArrivalLog::kRightInfo, 3.0, 0.0);
  EXPECT_EQ(log_.explainSilence(), "no synchronised stereo pair; received: /l/image 2 /r/image 0 /l/info 0 /r/info 1");
  EXPECT_EQ(log_.explainSilence(), "no synchronised stereo pair; received: /l/image 0 /r/image 0 /l/info 0 /r/info 0");
}

TEST_F(ArrivalLogTest, TheGapIsThatBetweenLeftAndRightNotWithinOneSide) {
  // One side alone runs at 1 ms; the other is 0.25 s off at best.
  for (int i = 0; i < 10; ++i) note(ArrivalLog::kLeftImage, 10.0 + 0.001 * i, 0.0);
  note(ArrivalLog::kRightImage, 10.259, 0.0);
  EXPECT_TRUE(contains(log_.explainSilence(),
                       "smallest gap between a left and a right image stamp 0.25 s, larger than sync_tolerance "
                       "(0.001 s): set approximate_sync"));
}

TEST_F(ArrivalLogTest, ExtremeStampsAreCompared) {
  log_.note(ArrivalLog::kLeftImage, ros::Time(0xffffffffu, 999999999u), 0.0);
  log_.note(ArrivalLog::kRightImage, ros::Time(0, 1), 0.0);
  EXPECT_TRUE(contains(log_.explainSilence(), "smallest gap"));
}

TEST_F(ArrivalLogTest, ZeroStampsAreSaid) {
  for (int i = 0; i < 3; ++i) note(ArrivalLog::kLeftImage, 0.0, 0.1 * i);
  EXPECT_TRUE(contains(log_.explainSilence(), "/l/image 3 (3 with zero stamps)"));
}

TEST_F(ArrivalLogTest, OneSideThatIsLateAsksForALongerQueue) {
  // 32 Hz, equal stamps; the right camera's messages come 0.75 s later: 24 periods.
  for (int i = 0; i < 60; ++i) {
    const double stamp = 10.0 + i / 32.0;
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kLeftInfo}) note(input, stamp, i / 32.0);
    for (const auto input : {ArrivalLog::kRightImage, ArrivalLog::kRightInfo}) note(input, stamp, i / 32.0 + 0.75);
  }
  const std::string text = log_.explainSilence();
  EXPECT_TRUE(contains(text, "0.75 s apart: set sync_queue_size, now 20, to at least 26")) << text;
  EXPECT_FALSE(contains(text, "approximate_sync")) << text;
}

TEST_F(ArrivalLogTest, CameraInfoWithOtherStampsIsNamed) {
  for (int i = 0; i < 5; ++i) {
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kLeftInfo})
      note(input, 10.0 + i, i);
    note(ArrivalLog::kRightInfo, 10.25 + i, i);
  }
  EXPECT_TRUE(
      contains(log_.explainSilence(), "the stamps of /r/info are not those of the left images, at best 0.25 s"));
}

struct ApproximateArrivalLogTest : ArrivalLogTest {
  ApproximateArrivalLogTest() : ArrivalLogTest(true) {}
};

/// A driver that publishes it once, latched.
TEST_F(ArrivalLogTest, CameraInfoThatComesOnceIsNamed) {
  for (int i = 0; i < 3; ++i)
    for (const auto input : {ArrivalLog::kLeftImage, ArrivalLog::kRightImage, ArrivalLog::kRightInfo})
      log_.note(input, ros::Time(10.0 + i), 0.0);
  const std::string text = log_.explainSilence();
  EXPECT_TRUE(contains(text, "; /l/info must have a message for each image")) << text;
  EXPECT_FALSE(contains(text, "; /r/info must")) << text;
}

TEST_F(ApproximateArrivalLogTest, DoesNotAdviseWhatIsSetAlready) {
  note(ArrivalLog::kLeftImage, 10.0, 0.0);
  note(ArrivalLog::kRightImage, 10.02, 0.0);
  EXPECT_TRUE(contains(log_.explainSilence(), "0.02 s, larger than max_interval (0.01 s)"));
}

}  // namespace test_arrival_log
}  // namespace sdvo
