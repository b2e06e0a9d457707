#include <gtest/gtest.h>

#include "../../src/rig/right_rotation.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_right_rotation {

/// Where a right camera that turned by `rotation` sees what it saw at (u, v) before.
Eigen::Vector2d seenTurned(const StereoCamera& camera, double u, double v, const Eigen::Vector3d& rotation) {
  const Eigen::Vector3d ray =
      expSO3(-rotation) * Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
  return {camera.fx * ray.x() / ray.z() + camera.cx, camera.fy * ray.y() / ray.z() + camera.cy};
}

TEST(RightRotation, JacobianIsThatOfTurnedRays) {
  const StereoCamera camera = synthetic::camera();
  for (const double u : {20.0, 300.0, 610.0})
    for (const double v : {10.0, 450.0})
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d rotation = 1e-5 * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector2d moved = seenTurned(camera, u, v, rotation) - Eigen::Vector2d(u, v);
        EXPECT_LT((rotationJacobian(camera, u, v) * rotation - moved).norm(), 1e-3 * moved.norm() + 1e-6);
      }
}

TEST(RightRotation, IsTakenBack) {
  const Eigen::Vector3d rotation(1e-3, -2e-3, 3e-3);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  features.append({400.f, 100.f, 30.f, 0.2f, 10.f, -1.f, 1.f});
  features.append({50.f, 400.f, 1e-3f, 0.f, 10.f, -1.f, 1.f});  // nearly at infinity
  StereoFeatures turned = features;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector2d right =
        seenTurned(features.camera, features.u[i] - features.disparity[i], features.v[i] + features.dv[i], rotation);
    turned.disparity[i] = static_cast<float>(features.u[i] - right.x());
    turned.dv[i] = static_cast<float>(right.y() - features.v[i]);
  }
  const StereoFeatures back = rotatedBack(turned, rotation);
  EXPECT_NEAR(back.disparity[0], features.disparity[0], 0.01);
  EXPECT_NEAR(back.dv[0], features.dv[0], 0.01);
  EXPECT_GT(rotatedBack(features, -rotation).disparity[1], 0.f) << "no point ends behind infinity";
}

/// A motion's inliers by a right camera that turned; their mean square error in units of the covariance.
TEST(RightRotation, IsFoundByDisparitiesTogetherWithTheMotion) {
  const StereoCamera camera = synthetic::camera();
  const NoiseOptions noise;
  const Eigen::Vector3d truth(0.0, 3e-3, 0.0);
  const Eigen::Isometry3d T_current_reference = expSE3((Vector6d() << 0.1, 0.0, -0.8, 0.0, 0.02, 0.0).finished());
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  double square = 0.0;
  constexpr int kTrials = 50;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<Correspondence> correspondences;
    std::vector<int> inliers;
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    while (correspondences.size() < 200) {
      const Eigen::Vector3d point(8.0 * uniform(random), 4.0 * uniform(random), 13.0 + 8.0 * uniform(random));
      Eigen::Vector3d seen = camera.project(T_current_reference * point);
      if (!camera.sees(seen)) continue;
      const double disparity = seen.x() - seenTurned(camera, seen.z(), seen.y(), truth).x() +
                               std::hypot(noise.disparity, noise.common_disparity) * normal(random);
      seen.x() += noise.corner * normal(random), seen.y() += noise.corner * normal(random);
      seen.z() = seen.x() - disparity;
      inliers.push_back(static_cast<int>(correspondences.size()));
      correspondences.push_back({point, seen});
    }
    const auto found = rotationByDisparities(camera, noise, correspondences, inliers, T_current_reference);
    ASSERT_TRUE(found);
    const Eigen::Vector3d error = found->value - truth;
    EXPECT_LT(std::abs(error.y()), 0.5e-3);
    square += error.dot(found->covariance.inverse() * error) / kTrials;
  }
  EXPECT_GT(square, 0.75) << "the covariance has twice the noise: that of points and that of parts";
  EXPECT_LT(square, 4.0);
  EXPECT_FALSE(rotationByDisparities(camera, noise, {}, {}, T_current_reference));
}

}  // namespace sdvo::test_right_rotation
