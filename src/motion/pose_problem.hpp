#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "correspondence_arrays.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "three_point_pose.hpp"

namespace sdvo {

/// Residual (measurement - projection, px) of a correspondence under T_current_reference; nothing when the point is not
/// in front of the camera.
std::optional<Eigen::Vector3d> reprojectionResidual(const StereoCamera& camera,
                                                    const Eigen::Isometry3d& T_current_reference,
                                                    const Correspondence& correspondence);

/// Derivative of the projection of exp(xi) * T_current_reference * point by xi at zero, (u_left, v_left, u_right) rows.
Eigen::Matrix<double, 3, 6> motionJacobian(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                           const Eigen::Vector3d& point);

/// Indices of the correspondences that a minimal solver takes.
using MinimalSample = std::array<int, 3>;

/// What every sample consensus works on: correspondences with outliers, the minimal solver and the consensus of a pose.
class PoseProblem {
 public:
  /// Both arguments must outlive the problem; `inlier_threshold` bounds the residual's length in px.
  PoseProblem(const StereoCamera& camera, const std::vector<Correspondence>& correspondences, double inlier_threshold)
      : camera_(camera), correspondences_(correspondences), arrays_(correspondences), threshold_(inlier_threshold) {}

  int count() const { return static_cast<int>(correspondences_.size()); }
  const StereoCamera& camera() const { return camera_; }
  const std::vector<Correspondence>& correspondences() const { return correspondences_; }

  /// Up to four poses T_current_reference from three correspondences, by the left view (P3P).
  PoseCandidates solve(const MinimalSample& sample) const;

  /// Sum over all correspondences of the squared residual, cut off at the threshold (MSAC, Torr and Zisserman 2000),
  /// px^2; the smaller the better. Stops early, at some value above it, once `cost_to_beat` is out of reach.
  double truncatedCost(const Eigen::Isometry3d& T_current_reference,
                       double cost_to_beat = std::numeric_limits<double>::max()) const;

  /// The truncated cost of a pose that no correspondence agrees with.
  double worstCost() const { return threshold_ * threshold_ * count(); }

  /// Number of correspondences that are no inliers (RANSAC); stops early likewise.
  double outlierCost(const Eigen::Isometry3d& T_current_reference,
                     double cost_to_beat = std::numeric_limits<double>::max()) const;

  /// Ascending indices of the correspondences within so many thresholds.
  std::vector<int> inliers(const Eigen::Isometry3d& T_current_reference, double thresholds = 1.0) const;

 private:
  /// Calls visit(i, squared residual) for one correspondence after the other until it returns false.
  template <class Visit>
  void visitSquares(const Eigen::Isometry3d& T_current_reference, const Visit& visit) const;

  const StereoCamera& camera_;
  const std::vector<Correspondence>& correspondences_;
  CorrespondenceArrays arrays_;
  double threshold_;
};

}  // namespace sdvo
