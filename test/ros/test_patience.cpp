#include <gtest/gtest.h>

#include "../../src/ros/node/throttles.hpp"

namespace sdvo::test_patience {

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

}  // namespace sdvo::test_patience
