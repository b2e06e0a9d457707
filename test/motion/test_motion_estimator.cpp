#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "../../src/motion/motion_estimator.hpp"
#include "../said.hpp"
#include "seen_points.hpp"

namespace sdvo::test_motion_estimator {

using Correspondences = std::vector<Correspondence>;

MotionEstimate estimate(const SeenPoints& seen, const MotionEstimatorOptions& options = {}) {
  return MotionEstimator(options).estimate(synthetic::camera(), seen.correspondences);
}

/// xi of T_estimated = exp(xi) * T_true.
Vector6d motionError(const MotionEstimate& estimate) {
  return logSE3(estimate.T_current_reference * trueMotion().inverse());
}

/// Fisher information about xi of the true inliers, by finite differences of the projection alone.
Matrix6d information(const SeenPoints& seen, double noise) {
  const StereoCamera camera = synthetic::camera();
  constexpr double kStep = 1e-5;
  Matrix6d sum = Matrix6d::Zero();
  for (const int i : seen.inliers) {
    const Eigen::Vector3d point = trueMotion() * seen.correspondences[static_cast<std::size_t>(i)].point;
    Eigen::Matrix<double, 3, 6> jacobian;
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d step = kStep * Vector6d::Unit(axis);
      jacobian.col(axis) =
          (camera.project(expSE3(step) * point) - camera.project(expSE3(-step) * point)) / (2.0 * kStep);
    }
    sum += jacobian.transpose() * jacobian / (noise * noise);
  }
  return sum;
}

void expectFailure(const MotionEstimate& estimate) {
  EXPECT_FALSE(estimate.success);
  EXPECT_FALSE(estimate.reason.empty());
  EXPECT_TRUE(estimate.T_current_reference.matrix().allFinite());
  EXPECT_TRUE(estimate.covariance.allFinite());
  EXPECT_TRUE(std::isfinite(estimate.rms));
}

TEST(MotionEstimator, JacobianIsTheDerivative) {
  const StereoCamera camera = synthetic::camera();
  constexpr double kStep = 1e-6;
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(1.0, -0.5, 6.0), Eigen::Vector3d(-4.0, 2.0, 20.0)}) {
    const Eigen::Matrix<double, 3, 6> jacobian = motionJacobian(camera, trueMotion(), point);
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d step = kStep * Vector6d::Unit(axis);
      const Eigen::Vector3d difference =
          (camera.project(expSE3(step) * trueMotion() * point) - camera.project(expSE3(-step) * trueMotion() * point)) /
          (2.0 * kStep);
      EXPECT_LT((jacobian.col(axis) - difference).norm(), 1e-4 * (1.0 + difference.norm())) << "axis " << axis;
    }
  }
}

TEST(MotionEstimator, ResidualIsMeasuredMinusProjected) {
  const StereoCamera camera = synthetic::camera();
  const Eigen::Vector3d point(1.0, -0.5, 6.0), shift(0.5, -1.0, 0.25);
  const auto residual =
      reprojectionResidual(camera, trueMotion(), {point, camera.project(trueMotion() * point) + shift});
  ASSERT_TRUE(residual);
  EXPECT_LT((*residual - shift).norm(), 1e-9);
  EXPECT_FALSE(reprojectionResidual(camera, trueMotion(), {{0.0, 0.0, -3.0}, {0.0, 0.0, 0.0}}));
}

TEST(MotionEstimator, RecoversExactMotion) {
  const SeenPoints seen = seenPoints(1, 60);
  const MotionEstimate found = estimate(seen);
  ASSERT_TRUE(found.success) << found.reason;
  EXPECT_LT(motionError(found).norm(), 1e-7);
  EXPECT_EQ(found.inliers, seen.inliers);
  EXPECT_LT(found.rms, 1e-5);
}

TEST(MotionEstimator, RecoversMotionAmongHalfOutliers) {
  constexpr double kNoise = 0.5;  // px
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const SeenPoints seen = seenPoints(seed, 240, kNoise, 0.5);
    MotionEstimatorOptions options;
    options.seed = static_cast<int>(seed);
    const MotionEstimate found = estimate(seen, options);
    ASSERT_TRUE(found.success) << found.reason;
    // In units of what the noise of the true inliers permits at best: chi square of six degrees of freedom, beyond 38
    // in one of a million; doubled for the efficiency of a robust kernel and the inliers lost at the threshold.
    const Vector6d error = motionError(found);
    EXPECT_LT(error.dot(information(seen, kNoise) * error), 76.0) << "seed " << seed;

    // The threshold, 2 px, is four standard deviations: 1.1e-3 of the inliers lie beyond.
    std::vector<int> right;
    std::set_intersection(found.inliers.begin(), found.inliers.end(), seen.inliers.begin(), seen.inliers.end(),
                          std::back_inserter(right));
    EXPECT_GE(right.size() + 4, seen.inliers.size());
    EXPECT_LE(found.inliers.size(), right.size() + 2);
    EXPECT_TRUE(std::is_sorted(found.inliers.begin(), found.inliers.end()));
    EXPECT_NEAR(found.rms, kNoise, 0.06);
  }
}

/// Mean squares of the errors in units of the covariance, over 300 motions: of all, translation and rotation.
Eigen::Vector3d meanNees(const MotionEstimatorOptions& options, double noise) {
  constexpr unsigned kTrials = 300, kPoints = 80;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const MotionEstimate found = estimate(seenPoints(1000 + trial, kPoints, noise), options);
    EXPECT_TRUE(found.success) << found.reason;
    EXPECT_EQ(found.inliers.size(), kPoints);
    EXPECT_LT((found.covariance - found.covariance.transpose()).norm(), 1e-15);
    const Vector6d error = motionError(found);
    const Eigen::Vector3d t = error.head<3>(), r = error.tail<3>();
    mean += Eigen::Vector3d(mahalanobisSquare(error, found.covariance),
                            t.dot(found.covariance.topLeftCorner<3, 3>().llt().solve(t)),
                            r.dot(found.covariance.bottomRightCorner<3, 3>().llt().solve(r))) /
            kTrials;
  }
  return mean;
}

TEST(MotionEstimator, CovarianceIsCalibrated) {
  MotionEstimatorOptions options;
  options.kernel_scale = 20.0;
  options.inlier_threshold = 6.0;  // twelve standard deviations
  const Eigen::Vector3d nees = meanNees(options, 0.5);
  // 6 F(6, 234) has mean 6.05 and variance 12.4; 4.5 standard deviations of a mean of 300 are 0.92. Likewise for 3.
  EXPECT_NEAR(nees[0], 6.05, 0.92);
  EXPECT_NEAR(nees[1], 3.03, 0.65);
  EXPECT_NEAR(nees[2], 3.03, 0.65);
}

TEST(MotionEstimator, CovarianceIsCalibratedWhereTheKernelBends) {
  for (const double noise : {0.3, 0.6, 0.9}) {
    MotionEstimatorOptions options;
    options.inlier_threshold = 6.0 * noise;
    const double mean = meanNees(options, noise)[0];
    // Where the kernel bends within the noise it says too little rather than too much.
    EXPECT_GT(mean, 4.0) << noise << " px";
    EXPECT_LT(mean, 6.97) << noise << " px";
  }
}

/// Most points of a far hedge, a few near ones: 700 px of focal length, points 70 to 80 m and 8 to 12 m away.
Correspondences farPoints(unsigned seed, const StereoCamera& camera) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.6);
  Correspondences far;
  for (int i = 0; i < 600; ++i) {
    const double z = i < 480 ? 70.0 + 10.0 * uniform(random) : 8.0 + 4.0 * uniform(random);
    Correspondence c;
    c.point = camera.backProject(camera.width * uniform(random), camera.height * uniform(random), camera.disparity(z));
    c.measurement = camera.project(trueMotion() * c.point);
    for (int k = 0; k < 3; ++k) c.measurement[k] += noise(random);
    far.push_back(c);
  }
  return far;
}

TEST(MotionEstimator, FarPointsDoNotHideTheNearOnes) {
  StereoCamera camera = synthetic::camera();
  camera.fx = camera.fy = 700.0;
  MotionEstimatorOptions options;
  options.max_iterations = 1;  // a sample that mostly has far points alone
  constexpr int kProblems = 100;
  int right = 0;
  for (options.seed = 1; options.seed <= kProblems; ++options.seed) {
    const Correspondences far = farPoints(static_cast<unsigned>(options.seed), camera);
    const MotionEstimate found = MotionEstimator(options).estimate(camera, far);
    right += found.success && found.inliers.size() > 570 && motionError(found).head<3>().norm() < 0.02;
  }
  EXPECT_GE(right, 65);  // of 49 with a near point in the sample, and most of the others
}

TEST(MotionEstimator, TriesTheExpectedMotionToo) {
  MotionEstimatorOptions options;
  options.max_iterations = 1;
  const SeenPoints seen = seenPoints(8, 240, 0.3, 0.7);
  ASSERT_FALSE(estimate(seen, options).success);
  const Eigen::Isometry3d change = expSE3((Vector6d() << 0.05, 0.0, -0.05, 0.005, 0.005, 0.0).finished());
  const MotionEstimate found =
      MotionEstimator(options).estimate(synthetic::camera(), seen.correspondences, change * trueMotion());
  ASSERT_TRUE(found.success) << found.reason;
  EXPECT_GE(found.inliers.size() + 2, seen.inliers.size());
  EXPECT_LT(motionError(found).norm(), 0.03);
}

TEST(MotionEstimator, AWrongExpectationDoesNoHarm) {
  const SeenPoints seen = seenPoints(9, 240, 0.3, 0.3);
  const MotionEstimate without = estimate(seen);
  const MotionEstimate with =
      MotionEstimator({}).estimate(synthetic::camera(), seen.correspondences, Eigen::Isometry3d::Identity());
  EXPECT_TRUE(with.T_current_reference.isApprox(without.T_current_reference, 1e-4));
  EXPECT_EQ(with.inliers, without.inliers);
}

TEST(MotionEstimator, FailsOnTooFewMatches) {
  MotionEstimatorOptions options;
  options.min_inliers = 12;
  for (const int count : {0, 1, 2, 3, 11}) {
    const MotionEstimate found = estimate(seenPoints(6, count, 0.1), options);
    expectFailure(found);
    EXPECT_TRUE(contains(found.reason, std::to_string(count))) << found.reason;
  }
  EXPECT_TRUE(estimate(seenPoints(6, 12, 0.1), options).success);
}

TEST(MotionEstimator, FailsWhenEverythingIsAnOutlier) {
  for (unsigned seed = 1; seed <= 5; ++seed) expectFailure(estimate(seenPoints(seed, 200, 0.5, 1.0)));
}

TEST(MotionEstimator, FailsOnDegenerateInput) {
  struct {
    const char* what;
    std::function<Eigen::Vector3d(int)> point;
    double noise;  // px
  } const cases[] = {
      {"one point", [](int) { return Eigen::Vector3d(0.5, 0.2, 8.0); }, 0.0},
      {"two points", [](int i) { return Eigen::Vector3d(i % 2, 0.2, 8.0); }, 0.0},
      {"one line", [](int i) { return Eigen::Vector3d(-2.0 + 0.07 * i, 0.3 + 0.01 * i, 6.0 + 0.1 * i); }, 0.0},
      // The measurements' noise lets a sample have a pose, yet the rotation about the line stays unknown.
      {"one line, noisy", [](int i) { return Eigen::Vector3d(-2.0 + 0.07 * i, 0.3, 6.0); }, 0.2},
      {"behind the camera", [](int i) { return Eigen::Vector3d(0.1 * i, 0.01 * i * i, -6.0 - 0.1 * i); }, 0.0},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.what);
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    SeenPoints seen;
    for (int i = 0; i < 60; ++i) {
      seen.correspondences.push_back({c.point(i), synthetic::camera().project(trueMotion() * c.point(i))});
      for (int k = 0; k < 3; ++k) seen.correspondences.back().measurement[k] += c.noise * normal(random);
    }
    expectFailure(estimate(seen));
  }
}

TEST(MotionEstimator, SurvivesMeasurementsThatAreNotFinite) {
  SeenPoints seen = seenPoints(7, 120, 0.3);
  for (std::size_t i = 0; i < seen.correspondences.size(); i += 5)
    seen.correspondences[i].measurement.x() = std::numeric_limits<double>::quiet_NaN();
  const MotionEstimate found = estimate(seen);
  EXPECT_TRUE(found.T_current_reference.matrix().allFinite());
  EXPECT_TRUE(found.covariance.allFinite());
  EXPECT_TRUE(!found.success || motionError(found).norm() < 0.1);
}

}  // namespace sdvo::test_motion_estimator
