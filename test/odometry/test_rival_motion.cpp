#include <gtest/gtest.h>

#include <random>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

namespace sdvo {
namespace test_rival_motion {

/// `first` points that moved by one motion, then `second` that moved by another.
std::vector<Correspondence> twoMotions(int first, int second, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Correspondence> correspondences;
  for (int i = 0; i < first + second; ++i) {
    const Eigen::Vector3d point(4.0 * uniform(random), 2.0 * uniform(random), 8.0 + 3.0 * uniform(random));
    correspondences.push_back({point, synthetic::camera().project((i < first ? a : b) * point)});
  }
  return correspondences;
}

Eigen::Isometry3d moved(double x) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().x() = x;
  return T;
}

TEST(RivalMotion, IsFoundAmongTheOutliersOfTheFirst) {
  const auto correspondences = twoMotions(100, 60, moved(0.0), moved(0.5));
  const MotionEstimator estimator({});
  const MotionEstimate first = estimator.estimate(synthetic::camera(), correspondences);
  ASSERT_TRUE(first.success);
  ASSERT_EQ(first.inliers.size(), 100u);
  std::vector<int> others;
  for (int i = 100; i < 160; ++i) others.push_back(i);
  const MotionEstimate rival = estimateAmong(estimator, synthetic::camera(), correspondences, others);
  ASSERT_TRUE(rival.success) << rival.reason;
  EXPECT_TRUE(rival.T_current_reference.isApprox(moved(0.5), 1e-6));
  EXPECT_EQ(rival.inliers, others) << "indices of all correspondences";
}

TEST(RivalMotion, FailsWithTheEstimatorsReason) {
  const auto correspondences = twoMotions(20, 20, moved(0.0), moved(0.5));
  const MotionEstimate none = estimateAmong(MotionEstimator({}), synthetic::camera(), correspondences, {1, 2, 3});
  EXPECT_FALSE(none.success);
  EXPECT_NE(none.reason.find("only 3 matches"), std::string::npos) << none.reason;
}

TEST(RivalMotion, MotionsAgreeThatProjectToTheSamePixel) {
  const auto correspondences = twoMotions(100, 0, moved(0.0), moved(0.0));
  std::vector<int> all;
  for (int i = 0; i < 100; ++i) all.push_back(i);
  // 400 px * 0.01 m / 8 m are half a pixel in both views, 0.05 m are 2.5 px.
  EXPECT_TRUE(agree(synthetic::camera(), correspondences, all, moved(0.0), moved(0.01)));
  EXPECT_FALSE(agree(synthetic::camera(), correspondences, all, moved(0.0), moved(0.05)));
  EXPECT_FALSE(agree(synthetic::camera(), correspondences, all, moved(0.0), moved(0.01), 0.3));
}

}  // namespace test_rival_motion
}  // namespace sdvo
