#include "motion_estimator.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Refines `start` over all correspondences within several thresholds of it, and keeps the result in T if its cost is
/// lower. Where most points are far, a pose can fit them while the near points, which alone constrain the translation,
/// are beyond the threshold: a refinement over inliers alone would leave them out (Lebeda, Matas and Chum 2012).
void refineWidely(const PoseProblem& problem, const MotionRefinementOptions& options, Eigen::Isometry3d start,
                  Eigen::Isometry3d& T) {
  constexpr double kWide = 5.0;  // thresholds
  refineMotion(problem.camera(), options, problem.correspondences(), problem.inliers(start, kWide), start);
  if (problem.truncatedCost(start) < problem.truncatedCost(T)) T = start;
}

}  // namespace

MotionEstimator::MotionEstimator(const MotionEstimatorOptions& options) : options_(checked(options)) {}

MotionEstimate MotionEstimator::estimate(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
                                         const std::optional<Eigen::Isometry3d>& expected, double noise) const {
  const MotionEstimatorOptions options = options_.scaled(noise);
  MotionEstimate estimate;
  const auto failed = [&](const std::string& reason) {
    estimate.reason = reason;
    return estimate;
  };
  const std::size_t count = correspondences.size();
  if (static_cast<int>(count) < options.min_inliers)
    return failed(text(0, "only ", count, " matches, at least ", options.min_inliers, " are needed"));

  // Reject outliers.
  const PoseProblem problem(camera, correspondences, options.inlier_threshold);
  const Consensus consensus = findConsensus(problem, options, options);
  Eigen::Isometry3d& T = estimate.T_current_reference = consensus.T_current_reference;
  if (consensus.found) refineWidely(problem, options, consensus.T_current_reference, T);
  if (expected) refineWidely(problem, options, *expected, T);
  estimate.inliers = problem.inliers(T);
  if (static_cast<int>(estimate.inliers.size()) < options.min_inliers)
    return failed(text(0, "only ", estimate.inliers.size(), " of ", count, " matches agree on one motion"));

  const NormalEquations equations = refineMotion(camera, options, correspondences, estimate.inliers, T);
  estimate.inliers = problem.inliers(T);
  if (static_cast<int>(estimate.inliers.size()) < options.min_inliers)
    return failed("only " + std::to_string(estimate.inliers.size()) + " matches agree with the refined motion");

  double square = 0.0;
  for (const int i : estimate.inliers)
    square += reprojectionResidual(camera, T, correspondences[i])->squaredNorm();  // inliers are in front of the camera
  estimate.rms = std::sqrt(square / (3.0 * static_cast<double>(estimate.inliers.size())));

  const Eigen::LDLT<Matrix6d> factor(equations.hessian);
  if (factor.info() != Eigen::Success || !factor.isPositive() || factor.rcond() < 1e-14)
    return failed("the matches do not determine the motion (all of them far away or on one line?)");
  estimate.covariance = equations.variance() * factor.solve(Matrix6d::Identity());
  estimate.covariance = 0.5 * (estimate.covariance + estimate.covariance.transpose()).eval();
  if (!T.matrix().allFinite() || !estimate.covariance.allFinite())
    return failed("the refinement did not converge to a finite motion");
  estimate.success = true;
  return estimate;
}

}  // namespace sdvo
