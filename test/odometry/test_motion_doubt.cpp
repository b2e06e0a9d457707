#include <gtest/gtest.h>

#include "stereo_descriptor_vo/odometry/motion_doubt.hpp"

namespace sdvo {
namespace test_motion_doubt {

TEST(CarriedDoubt, FadesByHalves) {
  CarriedDoubt doubt;
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.001, 1e-4);
  doubt.raise(CarriedDoubt::kCertain, "a knock");
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.99, 1e-3);
  doubt.raise(0.0, "less");
  EXPECT_EQ(doubt.cause(), "a knock");
  int doubtful = 0;
  for (; doubt.logOdds() > logOdds(0.05); ++doubtful) doubt.pass();
  EXPECT_EQ(doubtful, 4) << "as many pairs as make a point a lasting one";
  doubt.raise(50.0, "anything");
  EXPECT_LE(doubt.logOdds(), CarriedDoubt::kCertain);
}

}  // namespace test_motion_doubt
}  // namespace sdvo
