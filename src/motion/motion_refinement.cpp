#include "stereo_descriptor_vo/motion/motion_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace sdvo {
namespace {

/// Cauchy's kernel, its costs added up.
class Kernel {
 public:
  explicit Kernel(double scale) : square_(scale * scale), inverse_square_(1.0 / square_) {}

  /// Adds the cost of a squared residual and returns its weight.
  double add(double square) {
    const double ratio_square = square * inverse_square_;
    costs_.add(ratio_square);
    return 1.0 / (1.0 + ratio_square);
  }
  double cost() const { return square_ * costs_.value(); }

 private:
  double square_, inverse_square_;
  LogSum costs_;
};

/// The problem around one pose after the other.
class Lineariser {
 public:
  Lineariser(const StereoCamera& camera, const MotionRefinementOptions& options,
             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset)
      : camera_(camera), kernel_scale_(options.kernel_scale), arrays_(correspondences, subset) {
    weights_.resize(static_cast<std::size_t>(CorrespondenceArrays::roundedUp(arrays_.count())));
  }

  NormalEquations at(const Eigen::Isometry3d& T) {
    NormalEquations equations;
    Kernel kernel(kernel_scale_);
    arrays_.squareResiduals(camera_, T, 0, static_cast<int>(weights_.size()), weights_.data());
    const auto beyond = weights_.begin() + arrays_.count();
    for (auto at = weights_.begin(); at != beyond; ++at) {
      const double square = *at, weight = std::isinf(square) ? 0.0 : kernel.add(square);
      *at = weight;
      if (weight > 0.0) equations.weighted_square += weight * square;
      equations.weight += weight;
    }
    std::fill(beyond, weights_.end(), 0.0);
    arrays_.sumEquations(camera_, T, weights_.data(), equations.hessian, equations.gradient);
    equations.cost = kernel.cost();
    return equations;
  }

 private:
  const StereoCamera& camera_;
  double kernel_scale_;
  CorrespondenceArrays arrays_;
  std::vector<double> weights_;  ///< the squared residuals at first
};

}  // namespace

NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset,
                             Eigen::Isometry3d& T) {
  constexpr double kSmallestGain = 1e-5;  // of the cost: a tenth of the result's standard deviation
  double damping = 1e-6;
  Lineariser problem(camera, options, correspondences, subset);
  NormalEquations equations = problem.at(T);
  for (int iteration = 0; iteration < options.refinement_iterations; ++iteration) {
    Matrix6d damped = equations.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Vector6d step = damped.ldlt().solve(equations.gradient);
    if (!step.allFinite()) break;
    const Eigen::Isometry3d candidate = expSE3(step) * T;
    const NormalEquations next = problem.at(candidate);
    if (next.cost <= equations.cost) {
      const bool converged = equations.cost - next.cost <= kSmallestGain * equations.cost;
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
                             const std::vector<Correspondence>& correspondences, Eigen::Isometry3d& T) {
  std::vector<int> all(correspondences.size());
  std::iota(all.begin(), all.end(), 0);
  return refineMotion(camera, options, correspondences, all, T);
}

}  // namespace sdvo
