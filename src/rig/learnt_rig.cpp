#include "stereo_descriptor_vo/rig/learnt_rig.hpp"

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

}  // namespace sdvo
