#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "noise.hpp"
#include "pose_problem.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

// Cauchy's kernel. A residual of the square s, in units of the kernel's scale, costs log(1 + s).

/// Its weight in the normal equations: the derivative of the cost by s.
inline double cauchyWeight(double square) {
  return 1.0 / (1.0 + square);
}

/// The cost of many residuals, as the logarithm of a product: a multiplication for each is faster than a logarithm.
class CauchyCost {
 public:
  void add(double square) {
    constexpr double kFarFromOverflow = 1e150;
    product_ *= 1.0 + square;
    if (product_ > kFarFromOverflow) {
      sum_ += std::log(product_);
      product_ = 1.0;
    }
  }
  double value() const { return sum_ + std::log(product_); }

 private:
  double product_ = 1.0, sum_ = 0.0;
};

/// The weighted least squares problem around a pose, for the left perturbation xi = (translation, rotation) of it.
struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;             ///< sum of kernel costs, px^2
  double weighted_square = 0.0;  ///< sum of weight * |residual|^2, px^2
  double weight = 0.0;           ///< sum of weights

  /// Variance of one coordinate of a residual, px^2. Each point has three coordinates, which count by its weight; the
  /// motion takes six degrees of freedom.
  double variance() const { return weighted_square / std::max(3.0 * weight - 6.0, 1.0); }
};

/// Minimises the robust stereo reprojection error over (u_left, v_left, u_right), starting at T_current_reference and
/// leaving the result there. Returns the normal equations at the result. v_right is not used: after an imperfect
/// rectification it is off by more than the noise.
NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                             const std::vector<Correspondence>& correspondences,
                             Eigen::Isometry3d& T_current_reference);

/// The same on a subset, by indices of the correspondences.
NormalEquations refineMotion(const StereoCamera& camera, const MotionRefinementOptions& options,
                             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset,
                             Eigen::Isometry3d& T_current_reference);

}  // namespace sdvo
