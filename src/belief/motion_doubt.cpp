#include "stereo_descriptor_vo/belief/motion_doubt.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace sdvo {
void CarriedDoubt::raise(double log_odds, const std::string& cause) {
  if (log_odds <= log_odds_) return;
  log_odds_ = std::min(log_odds, kCertain);
  cause_ = cause;
}

void CarriedDoubt::pass() {
  // Pairs: half of those that make a point a lasting one, whose agreement is new evidence.
  constexpr double kHalfLife = 0.5 * MotionHypothesis::kLastingSightings;
  log_odds_ = kUnsuspected + (log_odds_ - kUnsuspected) * std::exp2(-1.0 / kHalfLife);
}

MotionDoubt::MotionDoubt(const MotionScene& scene, const MotionHypothesis& found, const CarriedDoubt& before) {
  const double rivals = 1.0 / found.probability - 1.0, misled = std::exp(logOddsMisled(scene, found));
  const double carried = std::exp(before.logOdds());
  log_odds = std::log(rivals + misled);
  probability = 1.0 / (1.0 + rivals + misled + carried);
  // Where nothing is expected, the camera may as well have stood.
  const ExpectedMotion expected = scene.prior.empty() ? ExpectedMotion() : scene.prior.front();
  const Vector6d innovation = expected.innovation(found.motion.T_current_reference.inverse());
  moment = (misled + carried) * probability * (momentOf(innovation) + expected.covariance);
  std::ostringstream words;
  if (found.rival && rivals >= std::max(misled, carried)) {
    words << "two motions in view, of " << found.agreement.inliers << " and " << found.rival->matches
          << " matches, the second with a probability of " << found.rival->probability
          << ": does something move in front of the camera?";
    cause = "something else moved in view";
  } else {
    words << (misled >= carried ? innovationWords(found) : "a moment ago " + before.cause())
          << ": followed with a probability of " << 1.0 - probability << " is something else";
    cause = "the motion changed faster than a vehicle's can";
  }
  reason = words.str();
}

std::string innovationWords(const MotionHypothesis& found) {
  std::ostringstream words;
  words << "the motion differs from the prior by " << std::sqrt(found.innovation)
        << " standard deviations (tracking/acceleration), " << found.agreement.lasting_inliers << " of "
        << found.agreement.lasting_matches << " lasting points agree";
  return words.str();
}

}  // namespace sdvo
