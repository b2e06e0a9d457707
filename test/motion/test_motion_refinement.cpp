#include <gtest/gtest.h>

#include <numeric>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/motion/motion_refinement.hpp"

namespace sdvo::test_motion_refinement {

Eigen::Isometry3d trueMotion() {
  Vector6d xi;
  xi << 0.1, -0.05, -0.9, 0.01, 0.03, -0.02;
  return expSE3(xi);
}

/// Points in a box, seen where they are under trueMotion().
std::vector<Correspondence> exactCorrespondences(int count) {
  const StereoCamera camera = synthetic::camera();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Correspondence> correspondences;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d point(8.0 * uniform(random) - 4.0, 4.0 * uniform(random) - 2.0, 5.0 + 15.0 * uniform(random));
    correspondences.push_back({point, camera.project(trueMotion() * point)});
  }
  return correspondences;
}

std::vector<int> all(const std::vector<Correspondence>& correspondences) {
  std::vector<int> indices(correspondences.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

/// Every point twice, off by the same shift to either side: the true motion is the best, all residuals are known.
std::vector<Correspondence> balancedCorrespondences(const Eigen::Vector3d& shift) {
  std::vector<Correspondence> balanced;
  for (const Correspondence& c : exactCorrespondences(20)) {
    balanced.push_back({c.point, c.measurement + shift});
    balanced.push_back({c.point, c.measurement - shift});
  }
  return balanced;
}

MotionRefinementOptions kernel(double scale) {
  MotionRefinementOptions options;
  options.kernel_scale = scale;
  return options;
}

double distance(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return logSE3(a.inverse() * b).norm();
}

TEST(RefineMotion, ReturnsToTheTruthFromAside) {
  const auto correspondences = exactCorrespondences(30);
  for (int axis = 0; axis < 6; ++axis)
    for (const double step : {-0.05, 0.05}) {
      Eigen::Isometry3d T = expSE3(step * Vector6d::Unit(axis)) * trueMotion();
      const NormalEquations result =
          refineMotion(synthetic::camera(), kernel(1.0), correspondences, all(correspondences), T);
      EXPECT_LT(distance(T, trueMotion()), 1e-6) << "axis " << axis;
      EXPECT_LT(result.cost, 1e-6);
      EXPECT_NEAR(result.weight, 30.0, 1e-3);
    }
}

TEST(RefineMotion, CauchysKernel) {
  const Eigen::Vector3d shift(0.6, 0.0, 0.8);  // 1 px long
  const auto correspondences = balancedCorrespondences(shift);
  Eigen::Isometry3d T = trueMotion();
  const NormalEquations result =
      refineMotion(synthetic::camera(), kernel(0.5), correspondences, all(correspondences), T);
  EXPECT_LT(distance(T, trueMotion()), 1e-9);
  EXPECT_NEAR(result.weight, 40.0 / 5.0, 1e-6);  // 1 / (1 + 2^2)
  EXPECT_NEAR(result.weighted_square, 40.0 / 5.0, 1e-6);
  EXPECT_NEAR(result.cost, 40.0 * 0.25 * std::log(5.0), 1e-6);
  EXPECT_LT(result.gradient.norm(), 1e-6);
}

TEST(RefineMotion, EquationsAreTheSumOverWeightedJacobians) {
  const auto correspondences = balancedCorrespondences({0.6, 0.0, 0.8});
  Eigen::Isometry3d T = trueMotion();
  const NormalEquations result =
      refineMotion(synthetic::camera(), kernel(0.5), correspondences, all(correspondences), T);
  Matrix6d expected = Matrix6d::Zero();
  for (const Correspondence& c : correspondences) {
    const auto jacobian = motionJacobian(synthetic::camera(), trueMotion(), c.point);
    expected += jacobian.transpose() * jacobian / 5.0;
  }
  EXPECT_LT((result.hessian - expected).norm(), 1e-6 * expected.norm());
}

TEST(RefineMotion, AnOutlierHardlyMoves) {
  auto correspondences = exactCorrespondences(30);
  correspondences[4].measurement += Eigen::Vector3d(60.0, -40.0, 50.0);
  Eigen::Isometry3d T = expSE3(0.02 * Vector6d::Ones()) * trueMotion();
  const NormalEquations result =
      refineMotion(synthetic::camera(), kernel(0.1), correspondences, all(correspondences), T);
  EXPECT_LT(distance(T, trueMotion()), 2e-3);
  EXPECT_LT(result.weight, 29.01);
  EXPECT_GT(result.weight, 28.0);
}

TEST(RefineMotion, LooksAtTheSubsetOnly) {
  auto correspondences = exactCorrespondences(30);
  std::vector<int> subset;
  for (int i = 0; i < 30; ++i) {
    if (i % 3 == 0)
      correspondences[i].measurement += Eigen::Vector3d(30.0, 30.0, 30.0);
    else
      subset.push_back(i);
  }
  Eigen::Isometry3d T = expSE3(0.02 * Vector6d::Ones()) * trueMotion();
  const NormalEquations result = refineMotion(synthetic::camera(), {}, correspondences, subset, T);
  EXPECT_LT(distance(T, trueMotion()), 1e-6);
  EXPECT_NEAR(result.weight, 20.0, 1e-6);
}

TEST(RefineMotion, LeavesOutWhatLiesBehindTheCamera) {
  auto correspondences = exactCorrespondences(30);
  correspondences.push_back({{0.0, 0.0, -5.0}, {300.0, 200.0, 290.0}});
  Eigen::Isometry3d T = expSE3(0.02 * Vector6d::Ones()) * trueMotion();
  const NormalEquations result = refineMotion(synthetic::camera(), {}, correspondences, all(correspondences), T);
  EXPECT_LT(distance(T, trueMotion()), 1e-6);
  EXPECT_NEAR(result.weight, 30.0, 1e-6);
}

TEST(RefineMotion, NeverEndsAtAHigherCost) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    auto correspondences = exactCorrespondences(8);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (Correspondence& c : correspondences)
      c.measurement += 40.0 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    Vector6d aside;  // far enough that some steps lead uphill
    for (int axis = 0; axis < 6; ++axis) aside[axis] = 0.5 * normal(random);
    MotionRefinementOptions options = kernel(1.0);
    double previous = std::numeric_limits<double>::max();
    for (const int iterations : {0, 1, 2, 3, 5, 10, 50}) {  // 0: the cost of the start
      options.refinement_iterations = iterations;
      Eigen::Isometry3d T = expSE3(aside) * trueMotion();
      const double cost = refineMotion(synthetic::camera(), options, correspondences, all(correspondences), T).cost;
      EXPECT_LE(cost, previous) << iterations << " iterations, seed " << seed;
      previous = cost;
    }
  }
}

// Small motions do not tell a perturbation of the left from one of the right.
TEST(RefineMotion, ReturnsToALargeMotionInAFewSteps) {
  Vector6d xi;
  xi << 0.5, -0.3, 0.4, 0.2, 1.6, -0.3;
  const Eigen::Isometry3d T_true = expSE3(xi);
  auto correspondences = exactCorrespondences(30);
  for (Correspondence& c : correspondences) c.point = T_true.inverse() * (trueMotion() * c.point);
  MotionRefinementOptions options;
  options.refinement_iterations = 5;
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Isometry3d T = expSE3(0.02 * Vector6d::Unit(axis)) * T_true;
    refineMotion(synthetic::camera(), options, correspondences, all(correspondences), T);
    EXPECT_LT(distance(T, T_true), 1e-6) << "axis " << axis;
  }
}

}  // namespace sdvo::test_motion_refinement
