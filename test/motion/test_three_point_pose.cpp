#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "../../src/motion/three_point_pose.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_three_point_pose {

/// Three points some metres in front of a camera that has moved a little, as between two pairs.
struct Sample {
  Eigen::Isometry3d T_camera_reference;
  std::array<Eigen::Vector3d, 3> points, rays;
};

Sample randomSample(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  Vector6d xi;
  for (int k = 0; k < 6; ++k) xi[k] = uniform(-1.0, 1.0) * (k < 3 ? 1.5 : 0.2);
  Sample sample;
  sample.T_camera_reference = expSE3(xi);
  for (std::size_t k = 0; k < 3; ++k) {
    const double depth = uniform(4.0, 40.0);
    const Eigen::Vector3d in_camera(depth * uniform(-0.8, 0.8), depth * uniform(-0.3, 0.3), depth);
    sample.points[k] = sample.T_camera_reference.inverse() * in_camera;
    sample.rays[k] = in_camera.normalized();
  }
  return sample;
}

double distanceToNearest(const PoseCandidates& candidates, const Eigen::Isometry3d& T) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Isometry3d& candidate : candidates)
    nearest = std::min(nearest, logSE3(candidate.inverse() * T).norm());
  return nearest;
}

TEST(ThreePointPose, TheTruthIsAmongTheCandidates) {
  std::mt19937 random(1);
  constexpr int kTrials = 2000;
  int found = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Sample sample = randomSample(random);
    found += distanceToNearest(solveThreePointPose(sample.points, sample.rays), sample.T_camera_reference) < 1e-6;
  }
  // Where two solutions nearly meet, rounding may take both away.
  EXPECT_GE(found, kTrials - 2);
}

TEST(ThreePointPose, EveryCandidateSeesThePointsAlongTheRays) {
  std::mt19937 random(2);
  std::size_t most = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Sample sample = randomSample(random);
    const PoseCandidates candidates = solveThreePointPose(sample.points, sample.rays);
    most = std::max(most, candidates.size());
    for (const Eigen::Isometry3d& T : candidates) {
      EXPECT_LT((T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-6) << trial;
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LT(((T * sample.points[k]).normalized() - sample.rays[k]).norm(), 1e-6) << trial;
    }
  }
  EXPECT_EQ(most, 4u);
}

/// Sides 12 and 23 and their angles alike: the cubic has no cubic term.
TEST(ThreePointPose, SymmetricTrianglesAreSolved) {
  for (const double apart : {0.5, 1.0, 2.0}) {
    const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d(-apart, 0.0, 5.0), Eigen::Vector3d(0.0, 1.0, 5.0),
                                                   Eigen::Vector3d(apart, 0.0, 5.0)};
    for (const int first : {0, 1, 2}) {
      std::array<Eigen::Vector3d, 3> turned, rays;
      for (std::size_t k = 0; k < 3; ++k) {
        turned[k] = points[(k + static_cast<std::size_t>(first)) % 3];
        rays[k] = turned[k].normalized();
      }
      const PoseCandidates candidates = solveThreePointPose(turned, rays);
      EXPECT_LT(distanceToNearest(candidates, Eigen::Isometry3d::Identity()), 1e-4) << apart << ", from " << first;
    }
  }
}

TEST(ThreePointPose, PointsOnALineGiveNone) {
  const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d(0.0, 0.0, 5.0), Eigen::Vector3d(1.0, 1.0, 6.0),
                                                 Eigen::Vector3d(2.0, 2.0, 7.0)};
  std::array<Eigen::Vector3d, 3> rays;
  for (std::size_t k = 0; k < 3; ++k) rays[k] = points[k].normalized();
  EXPECT_EQ(solveThreePointPose(points, rays).size(), 0u);
  EXPECT_EQ(solveThreePointPose({points[0], points[0], points[1]}, {rays[0], rays[0], rays[1]}).size(), 0u);
}

}  // namespace sdvo::test_three_point_pose
