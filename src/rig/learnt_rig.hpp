#pragma once

#include <limits>
#include <string>
#include <vector>

#include "../belief/belief.hpp"
#include "../belief/motion_hypotheses.hpp"
#include "../motion/noise.hpp"
#include "calibration_filter.hpp"
#include "right_camera_delay.hpp"
#include "right_rotation.hpp"
#include "row_pattern.hpp"
#include "row_readout.hpp"

namespace sdvo {

/// A pair with a measured motion, from which the rig is learnt.
struct MeasuredPair {
  const StereoFeatures& features;  ///< before compensation of the delay
  double dt;                       ///< s, since the previous pair
  Eigen::Isometry3d T_current_reference;
  double since_reference;  ///< s
  std::vector<RowMotion> rows;

  /// Mean velocity since the reference, in the camera's frame, m/s and rad/s.
  Vector6d velocity() const { return logSE3(T_current_reference.inverse()) / since_reference; }
};

/// A new rotation of the right camera, as rows and disparities of one pair imply it.
struct RotationHypothesis {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();       ///< rad
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< rad^2
  double log_odds = kUnsuspected;                        ///< that it rotated, against the noise of this rig
  double log_odds_of_other_moment = kUnsuspected;        ///< that left and right were taken at different times instead
  std::string words() const;
};

/// Estimates of a rig's calibration, rows, rotation, delay and noise, from its pairs.
struct LearntRig {
  CalibrationFilter calibration;
  RowPattern row_pattern;  ///< mean over confirmed pairs
  /// Rotation of the right camera since these estimates began, rad. Features are rotated back by it before all other
  /// steps.
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation_covariance = Eigen::Matrix3d::Zero();
  RightCameraDelay right_delay;
  RowReadout readout;
  Noise noise;

  LearntRig(const CalibrationOptions& options, const NoiseOptions& noise);

  /// New rotation of the right camera. `features`: rotated back by the known one and by the part `compensated` of the
  /// new one, rad; `found`: their motion, if any; `turns`, rad^2: second moment of the camera's rotations over the last
  /// two intervals, of `dt` s each.
  RotationHypothesis rotationHypothesis(const StereoFeatures& features, const MotionHypothesis& found,
                                        const Eigen::Vector3d& compensated, const Eigen::Matrix3d& turns,
                                        double dt) const;

  /// Rows of the motion's inliers over the last `dt` s, with the motion's velocities, because corners have more noise.
  std::vector<RowMotion> rowMotions(const StereoFeatures& features, const MotionHypothesis& found, double dt) const;

  /// Adds a new rotation, and returns how uncertain it leaves the rig. A rotation that undoes the last one counts as
  /// noise of this rig.
  RigEstimate::Matrix rotate(const RotationHypothesis& new_rotation, const StereoCamera& camera);

  /// Learns from a pair. A rotation is taken back if the next pair's matches agree on no motion: its images were wrong,
  /// not the rig. `features` are those with which the motion was found; `measured` has them with the delay. Refused
  /// pairs raise the odds of right images of other moments, unconfirmed ones interrupt the pairs of delay and readout.
  /// `measured` is null without a motion.
  void learn(const StereoFeatures& features, const MeasuredPair* measured, const MotionHypothesis& found,
             const RotationHypothesis& new_rotation, bool is_confirmed);

 private:
  NoiseOptions assumed_;
  /// Log-odds of a right image of another moment, before its rotation is considered. They are those of a knock at a
  /// pair that the rig monitor refused. Each pair after it halves the odds.
  double log_prior_of_other_moment_ = -std::numeric_limits<double>::infinity();
  double delay_sigma_;                                         ///< s: standard deviation of the delay of one pair
  Eigen::Matrix3d rotation_noise_ = Eigen::Matrix3d::Zero();   ///< rad^2: second moment of confirmed pairs' rotations
  Eigen::Vector3d rotation_before_ = Eigen::Vector3d::Zero();  ///< before the last rotate()
  Eigen::Matrix3d covariance_before_ = Eigen::Matrix3d::Zero();
  bool rotated_last_ = false;  ///< rotation and rotation_before_ differ by the last pair
};

}  // namespace sdvo
