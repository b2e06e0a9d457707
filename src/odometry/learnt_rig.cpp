#include "stereo_descriptor_vo/odometry/learnt_rig.hpp"

#include <algorithm>

namespace sdvo {

LearntRig::LearntRig(const CalibrationOptions& options, const Noise& assumed)
    : calibration(options), right_delay(options.right_delay), noise(assumed) {}

void LearntRig::learn(const MotionHypothesis& confirmed) {
  constexpr double kMost = 0.95;  // even if all agree, a few need not in the next pair (chosen)
  noise.learn(confirmed.motion.rms);
  right_rotation.learn();
  if (confirmed.lasting_square) noise.learnShared(*confirmed.lasting_square);
  const Agreement& agreement = confirmed.agreement;
  if (agreement.lasting_matches == 0) return;
  const double ratio = static_cast<double>(agreement.lasting_inliers) / agreement.lasting_matches;
  usual_agreement += (1.0 - kUsualMemory) * (std::min(ratio, kMost) - usual_agreement);
}

void LearntRig::report(OdometryResult& result) const {
  const RigCalibration::Vector sigma = calibration.sigma();
  if (sigma.allFinite()) {
    result.disparity_offset = calibration.calibration().value[0];
    result.disparity_bend = calibration.calibration().value[1];
    result.disparity_offset_sigma = sigma[0];
    result.disparity_bend_sigma = sigma[1];
  }
  if (const auto delay = right_delay.estimate())
    result.right_delay = delay->value, result.right_delay_sigma = delay->sigma;
  if (const auto rolling = readout.estimate()) result.readout = rolling->value, result.readout_sigma = rolling->sigma;
  result.right_rotation = right_rotation.rotation();
  result.right_rotation_sigma = right_rotation.sigma();
}

}  // namespace sdvo
