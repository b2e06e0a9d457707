#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace sdvo {

MotionEstimator::MotionEstimator(const MotionEstimatorOptions& options) : options_(checked(options)) {}

MotionEstimate MotionEstimator::estimate(const StereoCamera& camera,
                                         const std::vector<Correspondence>& correspondences) const {
  MotionEstimate estimate;
  const auto failed = [&](const std::string& reason) {
    estimate.success = false;
    estimate.reason = reason;
    return estimate;
  };
  const std::size_t count = correspondences.size();
  if (static_cast<int>(count) < options_.min_inliers)
    return failed("only " + std::to_string(count) + " matches, at least " + std::to_string(options_.min_inliers) +
                  " are needed");

  // Reject outliers.
  const PoseProblem problem(camera, correspondences, options_.inlier_threshold);
  const Consensus consensus = findConsensus(problem, options_, options_);
  estimate.iterations = consensus.iterations;
  estimate.inliers = consensus.inliers;
  if (static_cast<int>(estimate.inliers.size()) < options_.min_inliers)
    return failed("only " + std::to_string(estimate.inliers.size()) + " of " + std::to_string(count) +
                  " matches agree on one motion");

  // Refine; the better pose draws in inliers that the sample's pose missed, hence twice.
  Eigen::Isometry3d& T = estimate.T_current_reference = consensus.T_current_reference;
  NormalEquations equations;
  for (int round = 0; round < 2; ++round) {
    equations = refineMotion(camera, options_, correspondences, estimate.inliers, T);
    estimate.inliers = problem.inliers(T);
    if (static_cast<int>(estimate.inliers.size()) < options_.min_inliers)
      return failed("only " + std::to_string(estimate.inliers.size()) + " matches agree with the refined motion");
  }

  double square = 0.0;
  for (const int i : estimate.inliers)
    square += reprojectionResidual(camera, T, correspondences[i]).value_or(Eigen::Vector3d::Zero()).squaredNorm();
  estimate.rms = std::sqrt(square / (3.0 * static_cast<double>(estimate.inliers.size())));

  // Three residuals for each point, six parameters; weights below one take their share of the degrees of freedom.
  const double degrees_of_freedom = std::max(3.0 * equations.weight - 6.0, 1.0);
  const Eigen::LDLT<Matrix6d> factor(equations.hessian);
  if (factor.info() != Eigen::Success || !factor.isPositive() || factor.rcond() < 1e-14)
    return failed("the matches do not determine the motion (all of them far away or on one line?)");
  estimate.covariance = equations.weighted_square / degrees_of_freedom * factor.solve(Matrix6d::Identity());
  estimate.covariance = 0.5 * (estimate.covariance + estimate.covariance.transpose()).eval();
  estimate.success = T.matrix().allFinite() && estimate.covariance.allFinite();
  if (!estimate.success) return failed("the refinement did not converge to a finite motion");
  return estimate;
}

}  // namespace sdvo
