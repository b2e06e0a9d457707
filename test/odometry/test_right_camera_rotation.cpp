#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/odometry/right_camera_rotation.hpp"

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

TEST(RightCameraRotation, FollowsARigThatChangesAndForgetsSlowly) {
  const Eigen::Vector3d before(1e-3, 0.0, 0.0), after(-1e-3, 0.0, 0.0);
  RightCameraRotation filter;
  for (int k = 0; k < 100; ++k) filter.add(gridSeenWith(before));
  filter.add(gridSeenWith(after));
  EXPECT_LT((filter.rotation() - before).norm(), 0.2e-3) << "one pair counts as one of fifty";
  for (int k = 0; k < 300; ++k) filter.add(gridSeenWith(after));
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

TEST(RightCameraRotation, ATurnIsSaidOfARigThatWasSteady) {
  const Eigen::Vector3d turn(0.0, 0.0, 9e-3);
  RightCameraRotation filter;
  for (int k = 0; k < 20; ++k) EXPECT_LT(filter.add(gridSeenWith(Eigen::Vector3d::Zero())), 3.0);
  EXPECT_GT(changeOf(filter, gridSeenWith(turn)), 0.6);
  for (int k = 0; k < 5; ++k)
    EXPECT_GT(filter.add(gridSeenWith(turn)), 3.0) << "a turn does not become usual by lasting";
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
    EXPECT_LT(filter.add(features), 3.0) << "pair " << k;
  }
  EXPECT_GT(largest, 0.6) << "more than a steady rig may show";
  EXPECT_GT(filter.add(gridSeenWith(Eigen::Vector3d(0.0, 0.0, 60e-3))), 3.0);
}

TEST(RightCameraRotation, SigmaIsThatOfLeastSquaresForCorrelatedSightings) {
  // Every feature twice, off by the same amount to either side: the residuals are known and do not move the result.
  constexpr double kError = 0.2;  // px
  StereoFeatures features = gridSeenWith(Eigen::Vector3d::Zero());
  const int count = features.count();
  for (int i = 0; i < count; ++i) {
    features.dv[i] = kError;
    features.append({features.u[i], features.v[i], features.disparity[i], -kError, 10.f, -1.f, 1.f});
  }
  RightCameraRotation filter;
  filter.add(features);
  EXPECT_LT(filter.rotation().norm(), 1e-9);

  const StereoCamera& camera = features.camera;
  const double weight = 1.0 / (1.0 + kError * kError / (0.5 * 0.5));
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (int i = 0; i < features.count(); ++i) {
    const double x = (features.u[i] - features.disparity[i] - camera.cx) / camera.fx;
    const double y = (features.v[i] - camera.cy) / camera.fy;
    const Eigen::Vector3d effect = camera.fy * Eigen::Vector3d(1.0 + y * y, -x * y, -x);
    information += weight * effect * effect.transpose();
  }
  // Ten sightings in a row are worth one.
  const Eigen::Vector3d expected =
      std::sqrt(10.0) * kError * Eigen::Vector3d(information.inverse().diagonal().cwiseSqrt());
  EXPECT_LT((filter.sigma() - expected).norm(), 1e-3 * expected.norm())
      << filter.sigma().transpose() << " for " << expected.transpose();
}

TEST(RightCameraRotation, ShuttersThatAreApartWhileTheCameraTurnsAreTheRigsWay) {
  // A millisecond apart at 1 rad/s up and down: 1e-3 rad, 0.7 px at f = 700 px, in every pair.
  RightCameraRotation filter;
  int turned = 0, turned_late = 0;
  for (int i = 0; i < 60; ++i) {
    const bool said = filter.add(gridSeenWith({i % 8 < 4 ? 1e-3 : -1e-3, 0.0, 0.0})) > 3.0;
    turned += said, turned_late += said && i >= 30;  // 3 s
  }
  EXPECT_GT(turned, 0);
  EXPECT_EQ(turned_late, 0);
  EXPECT_GT(filter.add(gridSeenWith({0.0, 0.0, 20e-3})), 3.0) << "a knock is still found";
}

}  // namespace test_right_camera_rotation
}  // namespace sdvo
