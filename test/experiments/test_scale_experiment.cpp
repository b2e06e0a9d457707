#include <gtest/gtest.h>

#include "../../src/experiments/scale_experiment.hpp"

namespace sdvo {
namespace {

/// Geometric means of neighbours part the scale changes 1, 1.5, 2, 3, 4.
TEST(ScaleExperiment, AFeatureCountsForTheNearestScaleChange) {
  EXPECT_EQ(scaleIndex(1.0), 0);
  EXPECT_EQ(scaleIndex(1.22), 0);
  EXPECT_EQ(scaleIndex(1.23), 1);
  EXPECT_EQ(scaleIndex(1.72), 1);
  EXPECT_EQ(scaleIndex(1.74), 2);
  EXPECT_EQ(scaleIndex(2.44), 2);
  EXPECT_EQ(scaleIndex(2.46), 3);
  EXPECT_EQ(scaleIndex(3.46), 3);
  EXPECT_EQ(scaleIndex(3.47), 4);
  EXPECT_EQ(scaleIndex(4.6), 4);
}

TEST(ScaleExperiment, WhatShrinksOrGrowsMoreCountsForNone) {
  EXPECT_EQ(scaleIndex(0.8), -1);
  EXPECT_EQ(scaleIndex(0.9), 0);
  EXPECT_EQ(scaleIndex(4.9), -1);
}

}  // namespace
}  // namespace sdvo
