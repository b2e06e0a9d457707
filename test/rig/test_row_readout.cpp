#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/rig/row_readout.hpp"

namespace sdvo {
namespace test_row_readout {

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
    std::vector<Correspondence> points;
    for (int i = 0; i < 200; ++i) {
      const double u = camera.width * uniform(random), v = camera.height * uniform(random);
      const Eigen::Vector3d point = camera.backProject(u, v, 10.0 + 30.0 * uniform(random));
      const double late = readout * (v - camera.cy) / camera.height;
      Eigen::Vector3d pixel = camera.project(expSE3(late * velocity).inverse() * point);
      for (int axis = 0; axis < 2; ++axis) pixel[axis] += 0.3 * normal(random);
      points.push_back({point, pixel});
    }
    std::vector<int> all(points.size());
    std::iota(all.begin(), all.end(), 0);
    result.add(camera, Eigen::Isometry3d::Identity(), points, all, velocity);
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

}  // namespace test_row_readout
}  // namespace sdvo
