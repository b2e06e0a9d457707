#include "stereo_descriptor_vo/motion_estimator.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <random>

namespace sdvo {
namespace {

constexpr double kNearestDepth = 0.05;  // m, in front of the camera
using Correspondences = std::vector<Correspondence>;

/// Truncated squared error (Torr and Zisserman's MSAC): counts inliers and prefers those that fit well.
double score(const StereoCamera& camera, const Eigen::Isometry3d& T, const Correspondences& correspondences,
             double threshold, double score_to_beat) {
  const double limit = threshold * threshold;
  double sum = 0.0;
  for (const Correspondence& correspondence : correspondences) {
    const auto residual = reprojectionResidual(camera, T, correspondence);
    sum += residual ? std::min(residual->squaredNorm(), limit) : limit;
    if (sum >= score_to_beat) break;
  }
  return sum;
}

std::vector<int> findInliers(const StereoCamera& camera, const Eigen::Isometry3d& T,
                             const Correspondences& correspondences, double threshold) {
  std::vector<int> inliers;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const auto residual = reprojectionResidual(camera, T, correspondences[i]);
    if (residual && residual->norm() <= threshold) inliers.push_back(static_cast<int>(i));
  }
  return inliers;
}

std::array<std::size_t, 3> drawSample(std::mt19937& random, std::size_t count) {
  std::array<std::size_t, 3> sample{};
  for (std::size_t k = 0; k < sample.size();) {
    sample[k] = random() % count;
    if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
  }
  return sample;
}

/// Up to four poses from three correspondences, by the left view.
std::vector<Eigen::Isometry3d> solveP3P(const StereoCamera& camera, const Correspondences& correspondences,
                                        const std::array<std::size_t, 3>& sample) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const std::size_t i : sample) {
    const Correspondence& c = correspondences[i];
    points.emplace_back(c.point.x(), c.point.y(), c.point.z());
    rays.emplace_back((c.measurement.x() - camera.cx) / camera.fx, (c.measurement.y() - camera.cy) / camera.fy);
  }
  std::vector<cv::Mat> rotations, translations;
  const int solutions = cv::solveP3P(points, rays, cv::Matx33d::eye(), cv::noArray(), rotations, translations,
                                     cv::SOLVEPNP_AP3P);
  std::vector<Eigen::Isometry3d> poses;
  for (int s = 0; s < solutions; ++s) {
    Eigen::Vector3d rotation, translation;
    cv::cv2eigen(rotations[s], rotation);
    cv::cv2eigen(translations[s], translation);
    if (!rotation.allFinite() || !translation.allFinite()) continue;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = expSO3(rotation);
    T.translation() = translation;
    poses.push_back(T);
  }
  return poses;
}

/// Samples needed to draw one without outliers at the wanted confidence (Fischler and Bolles 1981).
double neededIterations(double inlier_ratio, double confidence) {
  const double all_inliers = std::pow(inlier_ratio, 3);
  if (all_inliers >= 1.0) return 1.0;
  if (all_inliers <= 1e-12) return std::numeric_limits<double>::max();
  return std::log(1.0 - confidence) / std::log(1.0 - all_inliers);
}

double kernelWeight(const MotionEstimatorOptions& options, double residual) {
  const double ratio = residual / options.kernel_scale;
  if (options.kernel == "huber") return ratio <= 1.0 ? 1.0 : 1.0 / ratio;
  return 1.0 / (1.0 + ratio * ratio);
}

double kernelCost(const MotionEstimatorOptions& options, double residual) {
  const double c = options.kernel_scale, ratio = residual / c;
  if (options.kernel == "huber") return ratio <= 1.0 ? residual * residual : c * (2.0 * residual - c);
  return c * c * std::log1p(ratio * ratio);
}

/// Normal equations of one reweighted step.
struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;            ///< sum of kernel costs, px^2
  double weighted_square = 0.0;  ///< sum of weight * |residual|^2, px^2
  double weight = 0.0;
};

NormalEquations linearise(const StereoCamera& camera, const MotionEstimatorOptions& options,
                          const Eigen::Isometry3d& T, const Correspondences& correspondences,
                          const std::vector<int>& subset) {
  NormalEquations equations;
  for (const int i : subset) {
    const auto residual = reprojectionResidual(camera, T, correspondences[i]);
    if (!residual) continue;
    const double length = residual->norm();
    const double weight = kernelWeight(options, length);
    const Eigen::Matrix<double, 3, 6> jacobian = motionJacobian(camera, T, correspondences[i].point);
    equations.hessian += weight * jacobian.transpose() * jacobian;
    equations.gradient += weight * jacobian.transpose() * *residual;
    equations.cost += kernelCost(options, length);
    equations.weighted_square += weight * length * length;
    equations.weight += weight;
  }
  return equations;
}

/// Levenberg-Marquardt over the left perturbation of T. Returns the normal equations at the result.
NormalEquations refine(const StereoCamera& camera, const MotionEstimatorOptions& options,
                       const Correspondences& correspondences, const std::vector<int>& subset, Eigen::Isometry3d& T) {
  constexpr double kSmallestStep = 1e-8;  // m and rad
  double damping = 1e-6;
  NormalEquations equations = linearise(camera, options, T, correspondences, subset);
  for (int iteration = 0; iteration < options.refinement_iterations; ++iteration) {
    Matrix6d damped = equations.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Vector6d step = damped.ldlt().solve(equations.gradient);
    if (!step.allFinite()) break;
    const Eigen::Isometry3d candidate = expSE3(step) * T;
    const NormalEquations next = linearise(camera, options, candidate, correspondences, subset);
    if (next.cost <= equations.cost) {
      T = candidate;
      equations = next;
      damping = std::max(damping * 0.1, 1e-9);
      if (step.norm() < kSmallestStep) break;
    } else {
      damping *= 10.0;
      if (damping > 1e6) break;
    }
  }
  return equations;
}

}  // namespace

std::optional<Eigen::Vector3d> reprojectionResidual(const StereoCamera& camera, const Eigen::Isometry3d& T,
                                                    const Correspondence& correspondence) {
  const Eigen::Vector3d point = T * correspondence.point;
  if (point.z() < kNearestDepth) return std::nullopt;
  return correspondence.measurement - camera.project(point);
}

Eigen::Matrix<double, 3, 6> motionJacobian(const StereoCamera& camera, const Eigen::Isometry3d& T,
                                           const Eigen::Vector3d& point) {
  const Eigen::Vector3d moved = T * point;
  const Eigen::Matrix3d projection = camera.projectionJacobian(moved);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << projection, -projection * skew(moved);
  return jacobian;
}

MotionEstimator::MotionEstimator(const MotionEstimatorOptions& options) : options_(checked(options)) {}

MotionEstimate MotionEstimator::estimate(const StereoCamera& camera, const Correspondences& correspondences) const {
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

  // Sample consensus.
  std::mt19937 random(static_cast<std::uint32_t>(options_.seed));
  Eigen::Isometry3d& T = estimate.T_current_reference;
  double best = std::numeric_limits<double>::max();
  double needed = options_.max_iterations;
  for (; estimate.iterations < std::max<double>(needed, options_.min_iterations) &&
         estimate.iterations < options_.max_iterations;
       ++estimate.iterations) {
    for (const Eigen::Isometry3d& candidate : solveP3P(camera, correspondences, drawSample(random, count))) {
      const double candidate_score = score(camera, candidate, correspondences, options_.inlier_threshold, best);
      if (candidate_score >= best) continue;
      best = candidate_score;
      T = candidate;
      const std::size_t inliers = findInliers(camera, T, correspondences, options_.inlier_threshold).size();
      needed = neededIterations(static_cast<double>(inliers) / static_cast<double>(count), options_.confidence);
    }
  }
  estimate.inliers = findInliers(camera, T, correspondences, options_.inlier_threshold);
  if (static_cast<int>(estimate.inliers.size()) < options_.min_inliers)
    return failed("only " + std::to_string(estimate.inliers.size()) + " of " + std::to_string(count) +
                  " matches agree on one motion");

  // Robust refinement; the better pose draws in inliers that the sample's pose missed, hence twice.
  NormalEquations equations;
  for (int round = 0; round < 2; ++round) {
    equations = refine(camera, options_, correspondences, estimate.inliers, T);
    estimate.inliers = findInliers(camera, T, correspondences, options_.inlier_threshold);
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
