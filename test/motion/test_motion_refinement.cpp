#include <gtest/gtest.h>

#include <numeric>

#include "../../src/motion/motion_refinement.hpp"
#include "seen_points.hpp"

namespace sdvo::test_motion_refinement {

/// Every point twice, off by the same shift to either side: the true motion is the best, all residuals are known.
std::vector<Correspondence> balancedCorrespondences(const Eigen::Vector3d& shift) {
  std::vector<Correspondence> balanced;
  for (const Correspondence& c : seenPoints(1, 20).correspondences) {
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

/// By all of them.
NormalEquations refine(const std::vector<Correspondence>& correspondences, Eigen::Isometry3d& T,
                       const MotionRefinementOptions& options = {}) {
  std::vector<int> all(correspondences.size());
  std::iota(all.begin(), all.end(), 0);
  return refineMotion(synthetic::camera(), options, correspondences, all, T);
}

/// Off in all six directions.
Eigen::Isometry3d aside() {
  return expSE3(0.02 * Vector6d::Ones()) * trueMotion();
}

TEST(RefineMotion, ReturnsToTheTruthFromAside) {
  const auto correspondences = seenPoints(1, 30).correspondences;
  for (int axis = 0; axis < 6; ++axis)
    for (const double step : {-0.05, 0.05}) {
      Eigen::Isometry3d T = expSE3(step * Vector6d::Unit(axis)) * trueMotion();
      const NormalEquations result = refine(correspondences, T, kernel(1.0));
      EXPECT_LT(distance(T, trueMotion()), 1e-6) << "axis " << axis;
      EXPECT_LT(result.cost, 1e-6);
      EXPECT_NEAR(result.weight, 30.0, 1e-3);
    }
}

TEST(RefineMotion, CauchysKernel) {
  const auto correspondences = balancedCorrespondences({0.6, 0.0, 0.8});  // 1 px long
  Eigen::Isometry3d T = trueMotion();
  const NormalEquations result = refine(correspondences, T, kernel(0.5));
  EXPECT_LT(distance(T, trueMotion()), 1e-9);
  EXPECT_NEAR(result.weight, 40.0 / 5.0, 1e-6);  // 1 / (1 + 2^2)
  EXPECT_NEAR(result.weighted_square, 40.0 / 5.0, 1e-6);
  EXPECT_NEAR(result.cost, 40.0 * 0.25 * std::log(5.0), 1e-6);
  EXPECT_LT(result.gradient.norm(), 1e-6);
  // The equations are the sum over weighted Jacobians.
  Matrix6d expected = Matrix6d::Zero();
  for (const Correspondence& c : correspondences) {
    const auto jacobian = motionJacobian(synthetic::camera(), trueMotion(), c.point);
    expected += jacobian.transpose() * jacobian / 5.0;
  }
  EXPECT_LT((result.hessian - expected).norm(), 1e-6 * expected.norm());
}

TEST(RefineMotion, AnOutlierHardlyMoves) {
  auto correspondences = seenPoints(1, 30).correspondences;
  correspondences[4].measurement += Eigen::Vector3d(60.0, -40.0, 50.0);
  Eigen::Isometry3d T = aside();
  const NormalEquations result = refine(correspondences, T, kernel(0.1));
  EXPECT_LT(distance(T, trueMotion()), 2e-3);
  EXPECT_LT(result.weight, 29.01);
  EXPECT_GT(result.weight, 28.0);
}

TEST(RefineMotion, LooksAtTheSubsetOnly) {
  auto correspondences = seenPoints(1, 30).correspondences;
  std::vector<int> subset;
  for (int i = 0; i < 30; ++i) {
    if (i % 3 == 0)
      correspondences[i].measurement += Eigen::Vector3d(30.0, 30.0, 30.0);
    else
      subset.push_back(i);
  }
  Eigen::Isometry3d T = aside();
  const NormalEquations result = refineMotion(synthetic::camera(), {}, correspondences, subset, T);
  EXPECT_LT(distance(T, trueMotion()), 1e-6);
  EXPECT_NEAR(result.weight, 20.0, 1e-6);
}

TEST(RefineMotion, LeavesOutWhatLiesBehindTheCamera) {
  auto correspondences = seenPoints(1, 30).correspondences;
  correspondences.push_back({{0.0, 0.0, -5.0}, {300.0, 200.0, 290.0}});
  Eigen::Isometry3d T = aside();
  EXPECT_NEAR(refine(correspondences, T).weight, 30.0, 1e-6);
  EXPECT_LT(distance(T, trueMotion()), 1e-6);
}

TEST(RefineMotion, NeverEndsAtAHigherCost) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const auto correspondences = seenPoints(seed, 8, 40.0).correspondences;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    Vector6d aside;  // far enough that some steps lead uphill
    for (int axis = 0; axis < 6; ++axis) aside[axis] = 0.5 * normal(random);
    MotionRefinementOptions options = kernel(1.0);
    double previous = std::numeric_limits<double>::max();
    for (const int iterations : {0, 1, 2, 3, 5, 10, 50}) {  // 0: the cost of the start
      options.refinement_iterations = iterations;
      Eigen::Isometry3d T = expSE3(aside) * trueMotion();
      const double cost = refine(correspondences, T, options).cost;
      EXPECT_LE(cost, previous) << iterations << " iterations, seed " << seed;
      previous = cost;
    }
  }
}

// Small motions do not tell a perturbation of the left from one of the right.
TEST(RefineMotion, ReturnsToALargeMotionInAFewSteps) {
  const Eigen::Isometry3d T_true = expSE3((Vector6d() << 0.5, -0.3, 0.4, 0.2, 1.6, -0.3).finished());
  auto correspondences = seenPoints(1, 30).correspondences;
  for (Correspondence& c : correspondences) c.point = T_true.inverse() * (trueMotion() * c.point);
  MotionRefinementOptions options;
  options.refinement_iterations = 5;
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Isometry3d T = expSE3(0.02 * Vector6d::Unit(axis)) * T_true;
    refine(correspondences, T, options);
    EXPECT_LT(distance(T, T_true), 1e-6) << "axis " << axis;
  }
}

}  // namespace sdvo::test_motion_refinement
