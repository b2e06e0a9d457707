#pragma once

#include <vector>

#include "stereo_descriptor_vo/belief/belief.hpp"
#include "stereo_descriptor_vo/belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"
#include "stereo_descriptor_vo/rig/right_camera_delay.hpp"
#include "stereo_descriptor_vo/rig/row_pattern.hpp"

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

/// Calibration, rows, delay and noise of the rig, estimated from its pairs.
struct LearntRig {
  CalibrationFilter calibration;
  RowPattern usual_rows{RowDelay::kMemory};  ///< of confirmed pairs
  RowPattern recent_rows{kUsualMemory};      ///< of all pairs: of the rig that the map is of
  double usual_turn = 0.0;                   ///< px^2: square of the rows' change from pair to pair
  RightCameraDelay right_delay;
  Noise noise;
  double usual_agreement = 0.9;  ///< ratio of lasting matches that agree with confirmed motions

  LearntRig(const CalibrationOptions& options, const Noise& assumed);

  /// Log-odds that the right camera turned since the last pairs.
  double logOddsOfTurn(const StereoFeatures& features) const;

  /// Takes in a pair whose motion is believed: confirmed ones teach all of it, doubted ones what follows the map alone.
  /// `measured` is null where the pair has no motion.
  void learn(const StereoFeatures& features, const MeasuredPair* measured, const MotionHypothesis& found,
             bool is_confirmed);
};

}  // namespace sdvo
