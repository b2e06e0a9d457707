#include <gtest/gtest.h>

#include "../../src/rig/row_pattern.hpp"
#include "turned_grid.hpp"

namespace sdvo::test_row_pattern {

TEST(RowPattern, IsUnknownBeforeTheFirstFeatures) {
  RowPattern pattern;
  EXPECT_FALSE(pattern.rotation());
  pattern.learn(synthetic::noFeatures(synthetic::camera()));
  EXPECT_FALSE(pattern.rotation());
  const StereoFeatures features = gridSeenWith({1e-3, 0.0, 0.0});
  EXPECT_FALSE(pattern.change(features));
  EXPECT_EQ(pattern.change(features, 5), features.dv[5]);
}

TEST(RowPattern, FindsEachAxisWithItsSign) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double angle : {-1e-3, 1e-3}) {
      const Eigen::Vector3d truth = angle * Eigen::Vector3d::Unit(axis);
      RowPattern pattern;
      pattern.learn(gridSeenWith(truth));
      EXPECT_LT((pattern.rotation()->value - truth).norm(), 0.1e-3)
          << "axis " << axis << ": " << pattern.rotation()->value.transpose();
    }
}

TEST(RowPattern, AWrongMatchDoesNotMatter) {
  const Eigen::Vector3d truth(0.4e-3, -2.0e-3, 1.1e-3);
  RowPattern right, wrong;
  StereoFeatures features = gridSeenWith(truth);
  right.learn(features);
  features.dv[3] = 40.f;
  features.dv[70] = -25.f;
  wrong.learn(features);
  EXPECT_LT((wrong.rotation()->value - right.rotation()->value).norm(), 0.2e-3);
}

TEST(RowPattern, FollowsARigThatChanges) {
  const Eigen::Vector3d before(1e-3, 0.0, 0.0), after(-1e-3, 0.0, 0.0);
  RowPattern pattern;
  for (int k = 0; k < 50; ++k) pattern.learn(gridSeenWith(before));
  EXPECT_LT((pattern.change(gridSeenWith(after))->value - (after - before)).norm(), 0.05e-3);
  pattern.learn(gridSeenWith(after));
  EXPECT_LT((pattern.rotation()->value - before).norm(), 0.25e-3) << "one pair counts as one of many";
  for (int k = 0; k < 1000; ++k) pattern.learn(gridSeenWith(after));
  EXPECT_LT((pattern.rotation()->value - after).norm(), 0.05e-3);
}

TEST(RowPattern, WhatLastsAtItsPlaceIsNoChange) {
  // Rectification that errs by up to a pixel, otherwise in each part.
  StereoFeatures features = gridSeenWith({0.5e-3, 0.0, 1e-3});
  for (int i = 0; i < features.count(); ++i)
    features.dv[i] += static_cast<float>(std::sin(0.02 * features.u[i]) * std::cos(0.03 * features.v[i]));
  RowPattern pattern;
  pattern.learn(features);
  const auto change = pattern.change(features);
  EXPECT_LT(change->value.norm(), 1e-6);
}

/// Mean square of each axis' error by the mean variance, of rigs whose rows err by 0.2 px, in each feature or in whole
/// parts of the image.
Eigen::Vector3d squareByVariance(bool is_alike) {
  constexpr int kRigs = 200;
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.f, 0.2f);
  const StereoFeatures exact = gridSeenWith(Eigen::Vector3d::Zero());
  Eigen::Vector3d square = Eigen::Vector3d::Zero(), variance = square;
  for (int rig = 0; rig < kRigs; ++rig) {
    StereoFeatures features = exact;
    std::array<float, RowDelay::kParts> parts;
    for (float& part : parts) part = normal(random);
    for (int i = 0; i < features.count(); ++i)
      features.dv[i] =
          is_alike
              ? parts[RowDelay::partOf(features.u[i], features.v[i], features.camera.width, features.camera.height)]
              : normal(random);
    RowPattern pattern;
    pattern.learn(features);
    const auto rotation = pattern.rotation();
    square += rotation->value.cwiseAbs2();
    variance += rotation->covariance.diagonal();
  }
  return square.cwiseQuotient(variance);
}

TEST(RowPattern, CovarianceIsThatOfTheErrorsHoweverAlikeTheyAreInAPart) {
  for (const bool is_alike : {false, true})
    for (const double ratio : squareByVariance(is_alike)) EXPECT_NEAR(ratio, 1.0, 0.35);
}

TEST(RowPattern, MeanRowsThatFollowTheMeanFlowAreOfOtherPairs) {
  constexpr double kPeriod = 0.1;
  for (const double delay : {-kPeriod, 0.0, kPeriod}) {
    RowPattern pattern;
    for (int pair = 0; pair < 20; ++pair) {
      StereoFeatures features = gridSeenWith({0.3e-3, 0.0, -0.5e-3});
      std::vector<RowMotion> rows;
      for (int i = 0; i < features.count(); ++i) {
        const double velocity = 0.1 * (features.v[i] - features.camera.cy) + 0.02 * features.disparity[i];
        rows.push_back({velocity, 0.0,
                        RowDelay::partOf(features.u[i], features.v[i], features.camera.width, features.camera.height)});
        features.dv[i] += static_cast<float>(delay * velocity);
      }
      pattern.learn(features, rows);
    }
    EXPECT_EQ(pattern.isOfOtherPairs(kPeriod), delay != 0.0) << delay;
  }
}

}  // namespace sdvo::test_row_pattern
