#pragma once

#include "stereo_descriptor_vo/belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/rig/calibration_filter.hpp"
#include "stereo_descriptor_vo/rig/right_camera_delay.hpp"
#include "stereo_descriptor_vo/rig/right_camera_rotation.hpp"
#include "stereo_descriptor_vo/rig/row_readout.hpp"

namespace sdvo {

/// Calibration, delay, readout and noise of the rig, estimated from its pairs.
struct LearntRig {
  CalibrationFilter calibration;
  RightCameraRotation right_rotation;
  RightCameraDelay right_delay;
  RowReadout readout;
  Noise noise;
  double usual_agreement = 0.9;  ///< ratio of lasting matches that agree with confirmed motions

  LearntRig(const CalibrationOptions& options, const Noise& assumed);

  /// Takes in what agreement and what noise a confirmed motion has, and how its rig changed.
  void learn(const MotionHypothesis& confirmed);
};

}  // namespace sdvo
