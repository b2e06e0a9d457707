#include <gtest/gtest.h>

#include "../../src/ros/node/throttles.hpp"

namespace sdvo::test_throttles {

constexpr std::int64_t kMillisecond = 1000000;

/// Of stamps every `period` ms until a second is over.
int passed(Pace& pace, int period, int jitter = 0) {
  int count = 0;
  for (int t = 0; t < 1000; t += period) count += pace.isDue((10000 + t + t / period % 2 * jitter) * kMillisecond);
  return count;
}

TEST(Pace, WithoutALimitAllGoThrough) {
  Pace pace(0.0);
  EXPECT_EQ(passed(pace, 1), 1000);
}

TEST(Pace, NotMoreThanAllowedGoThrough) {
  Pace slow(10.0), odd(15.0), fast(100.0), jittery(10.0);
  EXPECT_EQ(passed(slow, 50), 10) << "every second one";
  EXPECT_EQ(passed(odd, 50), 10) << "of 20 Hz not 15 can be had evenly";
  EXPECT_EQ(passed(fast, 50), 20);
  EXPECT_EQ(passed(jittery, 100, 4), 10) << "none is lost to jitter";
}

TEST(Pace, StampsThatFallBeginAnew) {
  Pace pace(10.0);
  EXPECT_TRUE(pace.isDue(5000 * kMillisecond));
  EXPECT_FALSE(pace.isDue(5010 * kMillisecond));
  EXPECT_TRUE(pace.isDue(1000 * kMillisecond));
  EXPECT_FALSE(pace.isDue(1010 * kMillisecond));
}

TEST(Patience, WaitsAsLongAsItIsThere) {
  Patience patience(0.1);
  for (double now = 10.0; now < 20.0; now += 1.0) {
    EXPECT_EQ(patience.timeout(now), 0.1);
    patience.note(true, now);
  }
}

TEST(Patience, WaitsSeldomForWhatDoesNotCome) {
  Patience patience(0.1);
  double waited = 0.0;
  int waits = 0;
  for (int k = 0; k < 30 * 60; ++k) {  // a minute at 30 Hz
    const double now = 100.0 + k / 30.0;
    waited += patience.timeout(now), waits += patience.timeout(now) > 0.0;
    patience.note(false, now);
  }
  EXPECT_EQ(waits, 6) << "at 0, 1, 3, 7, 15 and 31 s";
  EXPECT_NEAR(waited, 0.6, 1e-9);
  EXPECT_EQ(patience.timeout(160.5), 0.0);
  EXPECT_EQ(patience.timeout(161.5), 0.1) << "never rests for more than half a minute";
}

TEST(Patience, IsBackWhenItComesAgain) {
  Patience patience(0.1);
  patience.note(false, 100.0);
  EXPECT_EQ(patience.timeout(100.5), 0.0);
  patience.note(true, 100.5);  // it was there without waiting
  EXPECT_EQ(patience.timeout(100.6), 0.1);
  patience.note(false, 100.6);
  EXPECT_EQ(patience.timeout(101.7), 0.1) << "rests for a second again";
}

TEST(ReportThrottle, LetsAKindThroughOnce) {
  ReportThrottle throttle;
  EXPECT_TRUE(throttle.allows("late"));
  EXPECT_FALSE(throttle.allows("late"));
  EXPECT_TRUE(throttle.allows("dark"));
}

TEST(ReportThrottle, NumbersMakeNoOtherKind) {
  ReportThrottle throttle;
  EXPECT_TRUE(throttle.allows("refused: v has 611 elements, u has 612"));
  EXPECT_FALSE(throttle.allows("refused: v has 7 elements, u has 1.5e-3"));
  EXPECT_TRUE(throttle.allows("refused: dv has 611 elements, u has 612"));
  EXPECT_TRUE(throttle.allows("/cam0/image_raw"));
  EXPECT_TRUE(throttle.allows("/cam1/image_raw"));
  EXPECT_TRUE(throttle.allows("left image is 640x480"));
  EXPECT_FALSE(throttle.allows("left image is 752x480"));
}

}  // namespace sdvo::test_throttles
