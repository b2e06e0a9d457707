#include "motion_refinement.hpp"

#include <Eigen/Cholesky>
#include <utility>

namespace sdvo {
namespace {

/// The problem around one pose after the other.
class Lineariser {
 public:
  Lineariser(const StereoCamera& camera, const MotionRefinementOptions& options,
             const std::vector<Correspondence>& correspondences)
      : camera_(camera), kernel_scale_(options.kernel_scale), arrays_(correspondences) {
    weights_.resize(static_cast<std::size_t>(CorrespondenceArrays::roundedUp(arrays_.count())));
  }

  NormalEquations at(const Eigen::Isometry3d& T) {
    const double kernel_square = kernel_scale_ * kernel_scale_, inverse_square = 1.0 / kernel_square;
    NormalEquations equations;
    CauchyCost costs;
    arrays_.squareResiduals(camera_, T, 0, static_cast<int>(weights_.size()), weights_.data());
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const double square = std::exchange(weights_[i], 0.0), bent = square * inverse_square;
      if (static_cast<int>(i) >= arrays_.count() || std::isinf(square)) continue;
      costs.add(bent);
      weights_[i] = cauchyWeight(bent);
      equations.weighted_square += weights_[i] * square;
      equations.weight += weights_[i];
    }
    arrays_.sumEquations(camera_, T, weights_.data(), equations.hessian, equations.gradient);
    equations.cost = kernel_square * costs.value();
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
                             const std::vector<Correspondence>& correspondences, Eigen::Isometry3d& T) {
  constexpr double kSmallestGain = 1e-5;  // of the cost: then a step is a tenth of the result's deviation (300 inliers)
  double damping = 1e-6;
  Lineariser problem(camera, options, correspondences);
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
                             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset,
                             Eigen::Isometry3d& T) {
  std::vector<Correspondence> some;
  some.reserve(subset.size());
  for (const int i : subset) some.push_back(correspondences[i]);
  return refineMotion(camera, options, some, T);
}

}  // namespace sdvo
