#include "stereo_descriptor_vo/rig/learnt_rig.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace sdvo {

LearntRig::LearntRig(const CalibrationOptions& options, const Noise& assumed)
    : calibration(options), right_delay(options), noise(assumed) {}

/// A turn against what changes on rigs, and on this one, as a rule.
double LearntRig::logOddsOfTurn(const StereoFeatures& features) const {
  constexpr double kUsualOfRigs = 0.2;  // px: undisturbed, KITTI's and EuRoC's rigs change by less
  constexpr double kKnock = 0.0175;     // rad: a degree (chosen)
  const auto change = recent_rows.change(features);
  if (!change || features.count() < kFewestMeasured) return kUnsuspected;
  const double usual = std::max(kUsualOfRigs * kUsualOfRigs, usual_turn);
  const Eigen::Matrix3d information = (change->covariance + usual * change->spread).inverse();
  return kUnsuspected + logBayesFactor<3>(change->value, information, kKnock * kKnock * Eigen::Matrix3d::Identity());
}

void LearntRig::learn(const StereoFeatures& features, const MeasuredPair* measured, const MotionHypothesis& found,
                      bool is_confirmed) {
  constexpr double kMost = 0.95;  // even if all agree, a few need not in the next pair (chosen)
  if (is_confirmed) {
    if (const auto change = recent_rows.change(features))
      usual_turn +=
          (1.0 - kUsualMemory) * (change->value.dot(change->spread.inverse() * change->value) / 3.0 - usual_turn);
    usual_rows.learn(features);
    noise.learn(found.motion.rms);
    if (found.lasting_square) noise.learnShared(*found.lasting_square);
    const Agreement& agreement = found.agreement;
    if (agreement.lasting_matches > 0) {
      const double ratio = static_cast<double>(agreement.lasting_inliers) / agreement.lasting_matches;
      usual_agreement += (1.0 - kUsualMemory) * (std::min(ratio, kMost) - usual_agreement);
    }
  }
  if (features.count() >= kFewestMeasured) recent_rows.learn(features);
  if (measured)
    right_delay.learn(measured->features, measured->dt, measured->velocity(), is_confirmed);
  else
    right_delay.interrupt();
}

}  // namespace sdvo
