#include <gtest/gtest.h>

#include "../../src/check/row_readout.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_row_readout {

/// 60 pairs of a camera that shakes, seen with a readout, s, and 0.3 px of noise.
RowReadout watched(double readout) {
  const StereoCamera camera = synthetic::camera();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  RowReadout result;
  for (int pair = 0; pair < 60; ++pair) {
    Vector6d velocity;
    velocity << 0.2, 0.0, 0.5, 0.6 * std::sin(0.9 * pair), std::cos(0.7 * pair), 0.3 * std::sin(1.1 * pair);
    StereoFeatures features;
    features.camera = camera;
    OdometryResult moved;
    moved.has_motion = true;
    moved.dt = 0.1;
    moved.T_previous_current = expSE3(moved.dt * velocity);
    moved.inliers = 200;
    for (int i = 0; i < 200; ++i) {
      const double u = camera.width * uniform(random), v = camera.height * uniform(random);
      const double disparity = 10.0 + 30.0 * uniform(random);
      const Eigen::Vector3d point = camera.backProject(u, v, disparity);
      const double late = readout * (v - camera.cy) / camera.height;
      const Eigen::Vector3d pixel = camera.project(expSE3(late * velocity).inverse() * point);
      const Eigen::Vector3d before = camera.project(moved.T_previous_current * point);
      features.u.push_back(static_cast<float>(pixel.x() + 0.3 * normal(random)));
      features.v.push_back(static_cast<float>(pixel.y() + 0.3 * normal(random)));
      features.disparity.push_back(static_cast<float>(disparity));
      moved.flow.push_back({static_cast<float>(before.x()), static_cast<float>(before.y()),
                            static_cast<float>(before.x() - before.z()), i, true});
    }
    result.add(features, moved);
  }
  return result;
}

TEST(RowReadout, FindsARollingShutter) {
  const auto found = watched(0.01).estimate();
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->value, 0.01, 0.001);
  EXPECT_TRUE(found->isRolling());
}

TEST(RowReadout, AGlobalShutterIsNone) {
  const auto found = watched(0.0).estimate();
  ASSERT_TRUE(found);
  EXPECT_LT(std::abs(found->value), 4.0 * found->sigma);
  EXPECT_FALSE(found->isRolling());
  EXPECT_FALSE(RowReadout().estimate());
}

}  // namespace sdvo::test_row_readout
