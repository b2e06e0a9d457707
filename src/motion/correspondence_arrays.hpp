#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// One point seen from two camera positions: the reference, where the motion begins, and the current one.
struct Correspondence {
  Eigen::Vector3d point;        ///< in the reference camera's left optical frame, m
  Eigen::Vector3d measurement;  ///< (u_left, v_left, u_right) in the current pair, px
};

/// Correspondences as one array for each of their six numbers, for kernels that work on several at once.
class CorrespondenceArrays {
 public:
  explicit CorrespondenceArrays(const std::vector<Correspondence>& correspondences);

  int count() const { return count_; }
  /// Six arrays of roundedUp(count()) numbers, zeros beyond the count: x, y, z of the points, u_left, v_left, u_right.
  const double* values() const { return values_.data(); }

  /// Correspondences in a register.
  static constexpr int kLanes = 4;
  static int roundedUp(int count) { return (count + kLanes - 1) / kLanes * kLanes; }

  /// Squared lengths, px^2, of the residuals (measurement - projection) under T_current_reference of `count`
  /// correspondences from `first` on. Both are multiples of kLanes. Infinite for a point that is not in front of the
  /// camera.
  void squareResiduals(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference, int first, int count,
                       double* squares) const;

  /// Sums over all: weight J^T J and weight J^T residual, for the derivative J of the projection by a left perturbation
  /// of T_current_reference. There are roundedUp(count()) weights; points that are not in front of the camera, and what
  /// is beyond the count, must have zero.
  void sumEquations(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference, const double* weights,
                    Matrix6d& hessian, Vector6d& gradient) const;

 private:
  int count_;
  std::vector<double> values_;
};

}  // namespace sdvo
