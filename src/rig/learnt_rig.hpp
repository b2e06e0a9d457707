#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../belief/belief.hpp"
#include "../belief/motion_hypotheses.hpp"
#include "right_camera_delay.hpp"
#include "right_rotation.hpp"
#include "row_pattern.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

namespace sdvo {

/// A pair whose motion was measured, as its rig learns from it.
struct MeasuredPair {
  const StereoFeatures& features;  ///< as taken
  double dt;                       ///< s, since the pair before
  Eigen::Isometry3d T_current_reference;
  double since_reference;  ///< s
  std::vector<RowMotion> rows;

  /// Mean of the camera in its own frame since the reference, m/s and rad/s.
  Vector6d velocity() const { return logSE3(T_current_reference.inverse()) / since_reference; }
};

/// A rotation of the right camera since the pairs before, as the rows and disparities of one pair show it.
struct ShownRotation {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();       ///< rad
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< rad^2
  double log_odds = kUnsuspected;                        ///< that it is one, and not what changes on this rig as a rule
  std::string words() const;
};

/// Calibration, rows, rotation, delay and noise of the rig, estimated from its pairs.
struct LearntRig {
  CalibrationFilter calibration;
  RowPattern usual_rows{RowDelay::kMemory};  ///< of confirmed pairs
  /// Of the right camera since the map began, rad. Features are rotated back by it before anything else is done.
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  Eigen::Matrix3d rotation_covariance = Eigen::Matrix3d::Zero();
  RightCameraDelay right_delay;
  Noise noise;
  double usual_agreement = 0.9;  ///< ratio of lasting matches that agree with confirmed motions

  LearntRig(const CalibrationOptions& options, const NoiseOptions& noise);

  /// `features`: as seen before the rotation that is known; `found`: their motion, if there is one; `rate`: of the
  /// camera's turn, rad/s.
  ShownRotation shownRotation(const StereoFeatures& features, const MotionHypothesis& found,
                              const Eigen::Vector3d& rate) const;

  /// Takes a rotation for true.
  void rotate(const ShownRotation& shown, const StereoCamera& camera);

  /// Takes in a pair whose motion is believed: confirmed ones teach all of it, doubted ones what follows the map alone.
  /// `measured` is null where the pair has no motion.
  void learn(const StereoFeatures& features, const MeasuredPair* measured, const MotionHypothesis& found,
             const ShownRotation& shown, bool is_confirmed);

 private:
  NoiseOptions assumed_;
  double delay_sigma_;  ///< s: of the moments at which single right images are taken
  Eigen::Matrix3d usual_change_ = Eigen::Matrix3d::Zero();     ///< rad^2: second moment of confirmed pairs' rotations
  Eigen::Vector3d rotation_before_ = Eigen::Vector3d::Zero();  ///< until the last one
  Eigen::Matrix3d covariance_before_ = Eigen::Matrix3d::Zero();
};

}  // namespace sdvo
