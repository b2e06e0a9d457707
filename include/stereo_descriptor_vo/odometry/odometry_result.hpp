#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

enum class TrackingState { kWaiting, kTracking, kDegraded, kLost };

inline const char* toString(TrackingState state) {
  constexpr const char* words[] = {"WAITING", "TRACKING", "DEGRADED", "LOST"};
  return words[static_cast<int>(state)];
}

/// A matched feature: its position in the last measured pair as the map predicts it, and its index in this pair.
struct FeatureFlow {
  float u_previous, v_previous, disparity_previous;  ///< px, left image
  int current;                                       ///< index of the pair's feature
  bool inlier;  ///< agrees with the pair's motion and with the adjusted map, even if the motion is rejected
};

/// State, pose and motion after one pair. Everything published is derived from this one object.
struct OdometryResult {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;      ///< empty only in TRACKING without remarks
  std::int64_t stamp = 0;  ///< of the left image, ns
  /// Probability that the measured motion is the camera's; NaN without a measurement.
  double probability = std::numeric_limits<double>::quiet_NaN();
  int epoch = 0;  ///< one more after a discontinuity of the pose; an earlier one in the map from before, found again

  bool has_pose = false;  ///< false while waiting or lost: nothing may be published then
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();  ///< origin: the first left camera
  Matrix6d pose_covariance = Matrix6d::Zero();  ///< of a right perturbation: T_origin_camera * exp(xi), m and rad

  bool has_motion = false;  ///< false for the first pair and right after a discontinuity
  double dt = 0.0;          ///< s: of the motion, from the last pose; if no motion is known, from the previous pair
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  Matrix6d motion_covariance = Matrix6d::Zero();  ///< of a right perturbation of T_previous_current
  /// Part of the motion that corrects the previous pose in the map: right perturbation like the motion's, m and rad.
  Vector6d correction = Vector6d::Zero();

  int features = 0, matches = 0, inliers = 0;
  double coverage = 0.0;  ///< ratio of the cells in an 8x4 grid over the image that have an inlier
  double rms = 0.0;       ///< residual of the motion's corners, before alignment and adjustment, px per coordinate
  double match_time = 0.0, motion_time = 0.0;  ///< s
  double distance = 0.0;                       ///< travelled since the start or reset, m
  int keyframe_id = 0;            ///< running number of the map's last key frame, this pair included; 0 without a map
  std::vector<FeatureFlow> flow;  ///< of all matches

  /// The rig's residual errors as estimated so far, with standard deviations; NaN until there is an estimate.
  double disparity_offset = std::numeric_limits<double>::quiet_NaN();        ///< in the image centre, px; compensated
  double disparity_offset_sigma = std::numeric_limits<double>::quiet_NaN();  ///< px
  double disparity_bend = std::numeric_limits<double>::quiet_NaN();  ///< its change at 45 degrees, px; compensated
  double disparity_bend_sigma = std::numeric_limits<double>::quiet_NaN();  ///< px
  double right_delay = std::numeric_limits<double>::quiet_NaN();           ///< s, beyond the stamps; compensated
  double right_delay_sigma = std::numeric_limits<double>::quiet_NaN();     ///< s
  double readout = std::numeric_limits<double>::quiet_NaN();               ///< of both shutters, first row to last, s
  double readout_sigma = std::numeric_limits<double>::quiet_NaN();         ///< s
  double used_readout = 0.0;  ///< by which rows are moved to the stamp, s; 0: they are not
  Eigen::Vector3d right_rotation = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());        ///< rad
  Eigen::Vector3d right_rotation_sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< rad

  /// Names what of pose and motion is not finite, or which covariance is not positive semidefinite; empty: none.
  std::string defect() const;
};

}  // namespace sdvo
