#include <gtest/gtest.h>

#include "../../src/motion/pose_problem.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_pose_problem {

constexpr double kThreshold = 2.0;  // px

/// Four points seen without error, then one off by 1 px, one by 2 px, one by 5 px and one behind the camera.
std::vector<Correspondence> gradedCorrespondences() {
  const StereoCamera camera = synthetic::camera();
  std::vector<Correspondence> correspondences;
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(1.0, 0.5, 8.0), Eigen::Vector3d(-2.0, 1.0, 10.0), Eigen::Vector3d(0.5, -1.5, 6.0),
        Eigen::Vector3d(-1.0, -0.5, 14.0), Eigen::Vector3d(2.0, 1.5, 12.0), Eigen::Vector3d(0.0, 1.0, 9.0),
        Eigen::Vector3d(1.5, -1.0, 7.0)})
    correspondences.push_back({point, camera.project(point)});
  correspondences[4].measurement += Eigen::Vector3d(0.6, 0.0, 0.8);
  correspondences[5].measurement += Eigen::Vector3d(0.0, 2.0 - 1e-9, 0.0);
  correspondences[6].measurement += Eigen::Vector3d(3.0, 4.0, 0.0);
  correspondences.push_back({{1.0, 1.0, -5.0}, {300.0, 200.0, 290.0}});
  return correspondences;
}

TEST(PoseProblem, CountsWhatAgreesWithAPose) {
  const StereoCamera camera = synthetic::camera();
  const auto correspondences = gradedCorrespondences();
  const PoseProblem problem(camera, correspondences, kThreshold);
  const Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  EXPECT_EQ(problem.count(), 8);
  EXPECT_EQ(problem.inliers(truth), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(problem.outlierCost(truth), 2.0);
  EXPECT_NEAR(problem.truncatedCost(truth), 1.0 + 4.0 + 4.0 + 4.0, 1e-6);
  EXPECT_EQ(problem.worstCost(), 32.0);
  Eigen::Isometry3d elsewhere = Eigen::Isometry3d::Identity();
  elsewhere.translation() << 0.0, 20.0, 0.0;
  EXPECT_EQ(problem.truncatedCost(elsewhere), problem.worstCost());
  EXPECT_EQ(problem.outlierCost(elsewhere), 8.0);
  EXPECT_TRUE(problem.inliers(elsewhere).empty());
}

TEST(PoseProblem, StopsOnceTheScoreIsOutOfReach) {
  const StereoCamera camera = synthetic::camera();
  auto correspondences = gradedCorrespondences();
  std::reverse(correspondences.begin(), correspondences.end());
  const PoseProblem problem(camera, correspondences, kThreshold);
  const Eigen::Isometry3d truth = Eigen::Isometry3d::Identity();
  EXPECT_NEAR(problem.truncatedCost(truth, 7.0), 8.0, 1e-6) << "after the first two";
  EXPECT_EQ(problem.outlierCost(truth, 1.0), 1.0) << "after the first";
  EXPECT_NEAR(problem.truncatedCost(truth, 13.1), 13.0, 1e-6);
  EXPECT_EQ(problem.outlierCost(truth, 2.5), 2.0);
}

TEST(PoseProblem, OneOfTheSolutionsOfAnExactSampleIsTheTruth) {
  const StereoCamera camera = synthetic::camera();
  Vector6d xi;
  xi << 0.3, -0.2, -1.5, 0.02, 0.1, -0.05;
  const Eigen::Isometry3d truth = expSE3(xi);
  auto correspondences = gradedCorrespondences();
  for (Correspondence& c : correspondences)
    if ((truth * c.point).z() > 0.0) c.measurement = camera.project(truth * c.point);
  const PoseProblem problem(camera, correspondences, kThreshold);
  for (const MinimalSample& sample : {MinimalSample{0, 1, 2}, MinimalSample{4, 3, 1}, MinimalSample{6, 5, 0}}) {
    double best = 1e9;
    const auto solutions = problem.solve(sample);
    EXPECT_LE(solutions.size(), 4u);
    for (const Eigen::Isometry3d& T : solutions) {
      EXPECT_LT((T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
      best = std::min(best, logSE3(T.inverse() * truth).norm());
    }
    EXPECT_LT(best, 1e-6);
  }
}

}  // namespace sdvo::test_pose_problem
