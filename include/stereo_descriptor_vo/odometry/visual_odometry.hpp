#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Stereo odometry on stereo features alone. Every pair is matched to a local map of the points around the camera,
/// separated from outliers by sample consensus, and adjusted together with the last key frames.
class VisualOdometry {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit VisualOdometry(const VisualOdometryOptions& options);
  ~VisualOdometry();

  /// Processes the next pair. Stamps must increase, features and guess must pass check(), else std::invalid_argument
  /// and the state is as before. `guess` is one more hypothesis of the motion, never a measurement. A pair's camera
  /// that isLike() the first one's continues the map; another camera starts a new epoch, unless guesses of the whole
  /// motion carry the pose there. A changed camera that the images refute is ignored for tracking/max_gap seconds; if
  /// it lasts, a new map begins with it in the same epoch.
  OdometryResult update(const StereoFeatures& features, const std::optional<MotionGuess>& guess = std::nullopt);

  /// Back to the initial pose and a new epoch; nothing is remembered.
  void reset();

  /// The next pair does not continue the last one (a pause, a restarted source). The odometry goes on where it finds
  /// the pair in its map, else from the last pose under a new epoch.
  void breakStream();

  /// Another source knows the last pose, with this covariance (right perturbation, m and rad); a new epoch begins. The
  /// pose itself stays: the caller moves the frame above the origin. The map is kept. After an interruption the next
  /// pair starts a map at the last pose instead. Throws std::invalid_argument, and changes nothing, when the covariance
  /// is not finite or not positive semidefinite.
  void setPoseCovariance(const Matrix6d& covariance);

  /// T_origin_camera of the last pair that had a pose.
  const Eigen::Isometry3d& lastPose() const;

  /// Takes other options over while running. Those of `map`, with its `noise`, take effect at the next start. Those of
  /// `calibration` do when the estimate begins anew (a reset, another camera).
  /// Throws std::invalid_argument, and keeps the old ones, when an option is out of its range.
  void configure(const VisualOdometryOptions& options);

  const VisualOdometryOptions& options() const;

  /// The camera's pose on the base, whose floor `planar` constrains; initially at the base's origin, looking ahead. A
  /// new pose counts as another camera: the odometry goes on from the base's last pose under a new epoch. The origin is
  /// where this camera was in the beginning. Throws std::invalid_argument when it is not a rigid motion.
  void mountAt(const Eigen::Isometry3d& T_base_camera);

  /// The local map's points at a finite distance, in the origin's frame, m; empty without a map.
  std::vector<Eigen::Vector3d> mapPoints() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sdvo
