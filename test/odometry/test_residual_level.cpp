#include "stereo_descriptor_vo/odometry/residual_level.hpp"

#include <gtest/gtest.h>

namespace sdvo {
namespace {

TEST(ResidualLevel, WhatIsUsualExceedsNothing) {
  ResidualLevel level;
  for (const double square : {2.0, 2.0, 1.0, 1.5, 0.0}) EXPECT_EQ(level.excess(square), 1.0);
}

TEST(ResidualLevel, OneLargerPairExceedsByItsRatio) {
  ResidualLevel level;
  for (int pair = 0; pair < 20; ++pair) level.excess(2.0);
  EXPECT_NEAR(level.excess(6.0), 3.0, 1e-12);
  EXPECT_EQ(level.excess(2.0), 1.0);
}

TEST(ResidualLevel, WhatLastsBecomesUsual) {
  ResidualLevel level;
  level.excess(2.0);
  double excess = 0.0, before = 10.0;
  for (int pair = 0; pair < 40; ++pair, before = excess) {
    excess = level.excess(6.0);
    EXPECT_LE(excess, before);
  }
  EXPECT_LT(excess, 1.05);
}

TEST(ResidualLevel, NoResidualsAtAllAreNoLevel) {
  ResidualLevel level;
  EXPECT_EQ(level.excess(0.0), 1.0);
  EXPECT_EQ(level.excess(1.0), 1.0);
}

}  // namespace
}  // namespace sdvo
