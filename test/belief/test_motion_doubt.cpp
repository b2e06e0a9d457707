#include <gtest/gtest.h>

#include <cmath>

#include "stereo_descriptor_vo/belief/motion_doubt.hpp"

namespace sdvo {
namespace test_motion_doubt {

TEST(CarriedDoubt, FadesByHalves) {
  CarriedDoubt doubt;
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.001, 1e-4);
  doubt.raise(CarriedDoubt::kCertain, "a knock");
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.999, 1e-4);
  doubt.raise(0.0, "less");
  EXPECT_EQ(doubt.cause(), "a knock");
  int doubtful = 0;
  for (; doubt.logOdds() > logOdds(0.05); ++doubtful) doubt.pass();
  EXPECT_EQ(doubtful, 4) << "as many pairs as make a point a lasting one";
  doubt.raise(50.0, "anything");
  EXPECT_LE(doubt.logOdds(), CarriedDoubt::kCertain);
}

TEST(CarriedDoubt, LastsUntilItSaysNothing) {
  CarriedDoubt doubt;
  EXPECT_FALSE(doubt.lasts());
  doubt.raise(logOdds(0.05), "a knock");
  EXPECT_TRUE(doubt.lasts());
  int pairs = 0;
  for (; doubt.lasts(); ++pairs) doubt.pass();
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.0015, 0.0005);
  EXPECT_GT(pairs, 4) << "longer than it makes a motion doubtful";
}

TEST(MotionDoubt, WhereNothingIsExpectedTheMotionIsAsUncertainAsItIsLong) {
  const LocalMap map({});
  const StereoFeatures features;
  const MotionScene scene{map, {}, features, {}, {}, {}};
  MotionHypothesis found;
  found.motion.T_current_reference.translation().z() = -2.0;
  CarriedDoubt before;
  before.raise(CarriedDoubt::kCertain, "a knock");
  const MotionDoubt doubt(scene, found, before);
  EXPECT_NEAR(doubt.probability, 0.001, 1e-4);
  EXPECT_NEAR(std::sqrt(doubt.moment(2, 2)), 2.0, 0.1);
}

}  // namespace test_motion_doubt
}  // namespace sdvo
