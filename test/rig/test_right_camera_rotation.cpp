#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/rig/right_camera_rotation.hpp"

namespace sdvo {
namespace test_right_camera_rotation {

/// A grid of features with large disparities, whose vertical ones come from turning the right camera by `rotation`: the
/// rays themselves are turned.
StereoFeatures gridSeenWith(const Eigen::Vector3d& rotation) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  const StereoCamera& camera = features.camera;
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 12; ++column) {
      const float u = 140.f + 40.f * static_cast<float>(column), v = 30.f + 50.f * static_cast<float>(row);
      const float disparity = 60.f + 10.f * static_cast<float>((row + column) % 5);
      const Eigen::Vector3d ray((u - disparity - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
      const Eigen::Vector3d turned = expSO3(-rotation) * ray;
      const auto dv = static_cast<float>(camera.fy * (turned.y() / turned.z() - ray.y()));
      features.append({u, v, disparity, dv, 10.f, -1.f, 1.f});
    }
  return features;
}

TEST(RightCameraRotation, IsUnknownBeforeTheFirstFeatures) {
  RightCameraRotation filter;
  EXPECT_TRUE(filter.rotation().array().isNaN().all());
  EXPECT_TRUE(filter.sigma().array().isNaN().all());
  filter.add(synthetic::noFeatures(synthetic::camera()));
  EXPECT_TRUE(filter.rotation().array().isNaN().all());
}

TEST(RightCameraRotation, FindsEachAxisWithItsSign) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double angle : {-1e-3, 1e-3}) {
      const Eigen::Vector3d truth = angle * Eigen::Vector3d::Unit(axis);
      RightCameraRotation filter;
      filter.add(gridSeenWith(truth));
      EXPECT_LT((filter.rotation() - truth).norm(), 5e-6) << "axis " << axis << ": " << filter.rotation().transpose();
    }
}

TEST(RightCameraRotation, AWrongMatchDoesNotMatter) {
  const Eigen::Vector3d truth(0.4e-3, -2.0e-3, 1.1e-3);
  StereoFeatures features = gridSeenWith(truth);
  features.dv[3] = 40.f;
  features.dv[70] = -25.f;
  RightCameraRotation filter;
  filter.add(features);
  filter.add(features);
  EXPECT_LT((filter.rotation() - truth).norm(), 3e-5);
}

/// What the odometry makes of a pair: one that contradicts the rig is doubted, others are confirmed.
double confirmOrDoubt(RightCameraRotation& filter, const StereoFeatures& features) {
  constexpr double kDoubtful = 2.8;  // times the usual change: e^(2.8^2 / 2 - 6.9) is 0.05
  const double turned = filter.add(features);
  if (turned < kDoubtful) filter.learn();
  return turned;
}

TEST(RightCameraRotation, FollowsARigThatChangesAndForgetsSlowly) {
  const Eigen::Vector3d before(1e-3, 0.0, 0.0), after(-1e-3, 0.0, 0.0);
  RightCameraRotation filter;
  for (int k = 0; k < 100; ++k) filter.add(gridSeenWith(before));
  filter.add(gridSeenWith(after));
  EXPECT_LT((filter.rotation() - before).norm(), 0.2e-3) << "one pair counts as one of fifty";
  for (int k = 0; k < 1000; ++k) filter.add(gridSeenWith(after));
  EXPECT_LT((filter.rotation() - after).norm(), 0.05e-3);
}

/// By how much a pair disagrees with those before of a steady rig, px.
double changeOf(RightCameraRotation filter, const StereoFeatures& features) {
  constexpr double kUsualOfRigs = 0.2;  // px
  return kUsualOfRigs * filter.add(features);
}

TEST(RightCameraRotation, ChangeIsWhatTheRowsOfAPairSayAgainstThoseBefore) {
  const Eigen::Vector3d before(0.3e-3, 0.0, -0.5e-3), turn(0.5e-3, 0.0, 1e-3);
  const StereoFeatures usual = gridSeenWith(before), turned = gridSeenWith(before + turn);
  RightCameraRotation filter;
  EXPECT_EQ(changeOf(filter, turned), 0.0);
  for (int k = 0; k < 5; ++k) filter.add(usual);
  EXPECT_EQ(changeOf(filter, synthetic::noFeatures(synthetic::camera())), 0.0);
  EXPECT_LT(changeOf(filter, usual), 0.01);
  double square = 0.0;
  for (int i = 0; i < usual.count(); ++i) square += std::pow(turned.dv[i] - usual.dv[i], 2) / usual.count();
  EXPECT_NEAR(changeOf(filter, turned), std::sqrt(square), 0.05 * std::sqrt(square));
  EXPECT_LT((filter.rotation() - before).norm(), 5e-6);
}

TEST(RightCameraRotation, ATurnIsSaidOfARigThatWasSteadyForAsLongAsItLasts) {
  const Eigen::Vector3d turn(0.0, 0.0, 9e-3);
  RightCameraRotation filter;
  for (int k = 0; k < 20; ++k) EXPECT_LT(confirmOrDoubt(filter, gridSeenWith(Eigen::Vector3d::Zero())), 2.8);
  EXPECT_GT(changeOf(filter, gridSeenWith(turn)), 0.6);
  for (int k = 0; k < 50; ++k) EXPECT_GT(confirmOrDoubt(filter, gridSeenWith(turn)), 2.8) << "pair " << k;
}

// The memory holds a part of both places then, and is near enough to either.
TEST(RightCameraRotation, AReturnToWhereItWasIsATurn) {
  const Eigen::Vector3d turn(0.0, 0.0, 0.005);
  RightCameraRotation filter;
  for (int i = 0; i < 60; ++i) filter.add(gridSeenWith(Eigen::Vector3d::Zero()));
  EXPECT_GT(filter.add(gridSeenWith(turn)), 3.0);
  for (int i = 0; i < 15; ++i) filter.add(gridSeenWith(turn));
  EXPECT_GT(filter.add(gridSeenWith(Eigen::Vector3d::Zero())), 3.0);
  EXPECT_LT(filter.add(gridSeenWith(Eigen::Vector3d::Zero())), 3.0);
}

TEST(RightCameraRotation, AFewFeaturesTellOfNoTurn) {
  RightCameraRotation filter;
  for (int k = 0; k < 20; ++k) filter.add(gridSeenWith(Eigen::Vector3d::Zero()));
  StereoFeatures wrong = synthetic::noFeatures(synthetic::camera());
  for (int i = 0; i < 3; ++i) wrong.append({200.f + 100.f * static_cast<float>(i), 150.f, 60.f, 1.4f, 10.f, -1.f, 1.f});
  EXPECT_EQ(changeOf(filter, wrong), 0.0);
  EXPECT_LT(filter.add(wrong), 3.0);
}

TEST(RightCameraRotation, ARigWhoseRowsAlwaysDisagreeIsNotSaidToTurn) {
  // Rows that say more and more of a rotation, as where what rectification left depends on the place in the image.
  RightCameraRotation filter, steady;
  for (int k = 0; k < 20; ++k) steady.add(gridSeenWith(Eigen::Vector3d::Zero()));
  double largest = 0.0;
  for (int k = 0; k < 100; ++k) {
    const StereoFeatures features = gridSeenWith(Eigen::Vector3d(0.0, 0.0, 6e-3 * std::sin(0.1 * k)));
    largest = std::max(largest, changeOf(steady, features));
    EXPECT_LT(confirmOrDoubt(filter, features), 2.8) << "pair " << k;
  }
  EXPECT_GT(largest, 0.6) << "more than a steady rig may show";
  EXPECT_GT(filter.add(gridSeenWith(Eigen::Vector3d(0.0, 0.0, 60e-3))), 2.8);
}

/// Mean square of the rotation's error in standard deviations, 3 where sigma is right, of rigs whose rows err by 0.2
/// px, in each pair anew or always alike at the same place.
double meanSquareInSigmas(bool is_alike) {
  constexpr int kRigs = 60, kPairs = 20;
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0.f, 0.2f);
  const StereoFeatures exact = gridSeenWith(Eigen::Vector3d::Zero());
  double sum = 0.0;
  for (int rig = 0; rig < kRigs; ++rig) {
    RightCameraRotation filter;
    StereoFeatures features = exact;
    for (int pair = 0; pair < kPairs; ++pair) {
      for (float& dv : features.dv)
        if (pair == 0 || !is_alike) dv = normal(random);
      filter.add(features);
    }
    sum += filter.rotation().cwiseQuotient(filter.sigma()).squaredNorm() / kRigs;
  }
  return sum;
}

TEST(RightCameraRotation, SigmaIsThatOfTheErrorsHoweverAlikeTheyAre) {
  EXPECT_NEAR(meanSquareInSigmas(false), 3.0, 1.2);
  EXPECT_NEAR(meanSquareInSigmas(true), 3.0, 1.2);
}

}  // namespace test_right_camera_rotation
}  // namespace sdvo
