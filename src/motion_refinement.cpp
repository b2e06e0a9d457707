#include "stereo_descriptor_vo/motion_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace sdvo {
namespace {

using Correspondences = std::vector<Correspondence>;

double kernelWeight(const MotionRefinementOptions& options, double residual) {
  const double ratio = residual / options.kernel_scale;
  if (options.kernel == "huber") return ratio <= 1.0 ? 1.0 : 1.0 / ratio;
  return 1.0 / (1.0 + ratio * ratio);
}

double kernelCost(const MotionRefinementOptions& options, double residual) {
  const double c = options.kernel_scale, ratio = residual / c;
  if (options.kernel == "huber") return ratio <= 1.0 ? residual * residual : c * (2.0 * residual - c);
  return c * c * std::log1p(ratio * ratio);
}

NormalEquations linearise(const StereoCamera& camera, const MotionRefinementOptions& options,
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

}  // namespace

NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                       const Correspondences& correspondences, const std::vector<int>& subset, Eigen::Isometry3d& T) {
  constexpr double kSmallestStep = 1e-6;  // m and rad
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

}  // namespace sdvo
