#include <gtest/gtest.h>

#include "../../src/ros/node/throttles.hpp"

namespace sdvo::test_pace {

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

}  // namespace sdvo::test_pace
