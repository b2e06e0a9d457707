#include <gtest/gtest.h>

#include "../../../test/synthetic_scene.hpp"
#include "../../experiments/aligned_motion.hpp"
#include "../../experiments/keypoint_set.hpp"

namespace sdvo::test_aligned_motion {

constexpr double kDepth = 8.0;  // m

/// A textured wall seen from `forward` metres ahead, and the given positions on it with their true disparities.
KeypointSet wallFrom(double forward, const std::vector<cv::Point2f>& positions) {
  KeypointSet set;
  set.camera = synthetic::camera();
  const synthetic::Texture texture(2, 8.0 * kDepth / set.camera.fx, 60.0 * kDepth / set.camera.fx);
  set.images.left = synthetic::renderPlane(texture, set.camera, kDepth - forward);
  for (const cv::Point2f& position : positions)
    set.corners.push_back({{position, 1.f}, {0, static_cast<float>(set.camera.disparity(kDepth - forward)), 0.f}});
  return set;
}

class AlignedMotion : public testing::Test {
 protected:
  /// Corners found up to a pixel beside their place in the second pair, most of them to the right of it, and the motion
  /// from the patches.
  Eigen::Isometry3d align(PatchWarp warp, double forward, int corners) {
    const StereoCamera camera = synthetic::camera();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> error(-0.7, 0.7);
    std::vector<cv::Point2f> first, second;
    std::vector<int> rows;
    std::vector<FeatureMatch> matches;
    for (int i = 0; i < corners; ++i) {
      const cv::Point2f p(static_cast<float>(120 + random() % 400), static_cast<float>(100 + random() % 280));
      Eigen::Vector3d point = camera.backProject(p.x, p.y, camera.disparity(kDepth));
      point.z() -= forward;
      const Eigen::Vector3d seen = camera.project(point);
      first.push_back(p);
      second.emplace_back(static_cast<float>(seen.x() + 0.4 + error(random)),
                          static_cast<float>(seen.y() + error(random)));
      rows.push_back(i);
      matches.push_back({i, i, 0.f});
    }
    const bool by_depth = warp == PatchWarp::kByDepth;
    const PatchLayout layout{13, 1.f, by_depth ? 0.1f : 0.f};
    const DepthScale curve(DepthScaleOptions{}.completedFor(DescriptorType::kFreak));
    const StereoFeatures reference = cutPatches(wallFrom(0.0, first), rows, curve, layout);
    const StereoFeatures current = cutPatches(wallFrom(forward, second), rows, curve, layout);
    Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
    T_current_reference.translation() = start_;
    return alignedMotion(MotionEstimatorOptions(), reference, current, matches, warp, T_current_reference);
  }

  Eigen::Vector3d start_{0.02, -0.01, -0.5};  ///< of T_current_reference, m
};

TEST_F(AlignedMotion, PatchesFindThePlacesThatCornersMissed) {
  const Eigen::Isometry3d T = align(PatchWarp::kByDepth, 0.6, 150);
  EXPECT_LT((T.translation() - Eigen::Vector3d(0.0, 0.0, -0.6)).norm(), 0.004);
}

TEST_F(AlignedMotion, WithoutDepthItIsAsGoodWhereTheScaleDoesNotChange) {
  start_ = {0.02, -0.01, 0.01};
  const Eigen::Isometry3d T = align(PatchWarp::kNone, 0.0, 150);
  EXPECT_LT(T.translation().norm(), 0.004);
}

TEST_F(AlignedMotion, WithoutDepthItIsWorseWhereTheScaleChanges) {
  start_ = {0.02, -0.01, -1.9};
  const Eigen::Vector3d truth(0.0, 0.0, -2.0);
  const double by_depth = (align(PatchWarp::kByDepth, 2.0, 150).translation() - truth).norm();
  const double plain = (align(PatchWarp::kNone, 2.0, 150).translation() - truth).norm();
  EXPECT_LT(by_depth, 0.01);
  EXPECT_GT(plain, 1.5 * by_depth);
}

TEST_F(AlignedMotion, TooFewPatchesLeaveTheMotionAsItWas) {
  const Eigen::Isometry3d T = align(PatchWarp::kByDepth, 0.6, 12);
  EXPECT_EQ(T.translation(), start_);
}

}  // namespace sdvo::test_aligned_motion
