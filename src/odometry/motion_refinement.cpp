#include "stereo_descriptor_vo/odometry/motion_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "log_sum.hpp"

namespace sdvo {
namespace {

using Correspondences = std::vector<Correspondence>;

/// The robust kernel by name, its costs added up.
class Kernel {
 public:
  explicit Kernel(const MotionRefinementOptions& options)
      : huber_(options.kernel == RobustKernel::kHuber), scale_(options.kernel_scale) {}

  /// Adds the cost of a residual and returns its weight.
  double add(double residual) {
    const double ratio = residual / scale_;
    if (huber_) {
      huber_cost_ += ratio <= 1.0 ? residual * residual : scale_ * (2.0 * residual - scale_);
      return ratio <= 1.0 ? 1.0 : 1.0 / ratio;
    }
    cauchy_cost_.add(ratio * ratio);
    return 1.0 / (1.0 + ratio * ratio);
  }
  double cost() const { return huber_ ? huber_cost_ : scale_ * scale_ * cauchy_cost_.value(); }

 private:
  bool huber_;
  double scale_;
  double huber_cost_ = 0.0;
  LogSum cauchy_cost_;
};

NormalEquations linearise(const StereoCamera& camera, const MotionRefinementOptions& options,
                          const Eigen::Isometry3d& T, const Correspondences& correspondences,
                          const std::vector<int>& subset) {
  NormalEquations equations;
  Kernel kernel(options);
  for (const int i : subset) {
    const auto residual = reprojectionResidual(camera, T, correspondences[i]);
    if (!residual) continue;
    const double square = residual->squaredNorm(), weight = kernel.add(std::sqrt(square));
    const Eigen::Matrix<double, 3, 6> jacobian = motionJacobian(camera, T, correspondences[i].point);
    const Eigen::Matrix<double, 3, 6> weighted = weight * jacobian;
    equations.hessian.noalias() += weighted.transpose() * jacobian;
    equations.gradient.noalias() += weighted.transpose() * *residual;
    equations.weighted_square += weight * square;
    equations.weight += weight;
  }
  equations.cost = kernel.cost();
  return equations;
}

}  // namespace

NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                             const Correspondences& correspondences, const std::vector<int>& subset,
                             Eigen::Isometry3d& T) {
  constexpr double kSmallestStep = 1e-6;  // m and rad
  constexpr double kSmallestGain = 1e-6;  // of the cost: a few hundredths of the result's standard deviation
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
      const bool converged = step.norm() < kSmallestStep || equations.cost - next.cost < kSmallestGain * equations.cost;
      T = candidate;
      equations = next;
      damping = std::max(damping * 0.1, 1e-9);
      if (converged) break;
    } else {
      damping *= 10.0;
      if (damping > 1e6) break;
    }
  }
  return equations;
}

NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                             const Correspondences& correspondences, Eigen::Isometry3d& T) {
  std::vector<int> all(correspondences.size());
  std::iota(all.begin(), all.end(), 0);
  return refineMotion(camera, options, correspondences, all, T);
}

}  // namespace sdvo
