#include "stereo_descriptor_vo/belief/belief.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace sdvo {

bool Doubt::lasts() const {
  return log_odds_ > kUnsuspected + std::log(2.0);
}

void Doubt::raise(double log_odds, const std::string& cause) {
  if (log_odds <= log_odds_) return;
  log_odds_ = std::min(log_odds, kCertain);
  cause_ = cause;
}

void Doubt::raise(const std::vector<Evidence>& evidence) {
  for (const Evidence& each : evidence) raise(each.log_odds, each.cause);
}

void Doubt::fade() {
  // Pairs: half of those that make a point a lasting one, whose agreement is new evidence.
  constexpr double kHalfLife = 0.5 * MotionHypothesis::kLastingSightings;
  log_odds_ = kUnsuspected + (log_odds_ - kUnsuspected) * std::exp2(-1.0 / kHalfLife);
  if (!lasts()) deviation_.setZero();
}

Belief Doubt::weigh(const MotionScene& scene, const MotionHypothesis& found, const std::vector<Evidence>& evidence) {
  const double rivals = 1.0 / found.probability - 1.0, misled = std::exp(logOddsMisled(scene, found));
  // Lasting points were confirmed before the doubt began.
  log_odds_ -= lasts() ? logAgreement(scene, found) : 0.0;
  const Evidence before{log_odds_, cause_};
  log_odds_ = std::clamp(log_odds_, kUnsuspected, kCertain);
  raise(evidence);
  const double shown = log_odds_ > before.log_odds ? std::exp(log_odds_) : 0.0, carried = std::exp(before.log_odds);

  Belief belief;
  belief.probability = 1.0 / (1.0 + rivals + misled + shown + carried);
  // Where nothing is expected, the camera may as well have stood.
  const ExpectedMotion expected = scene.prior.empty() ? ExpectedMotion() : scene.prior.front();
  const Vector6d innovation = expected.innovation(found.motion.T_current_reference.inverse());
  const Matrix6d deviation = momentOf(innovation) + expected.covariance;
  const double another = (misled + shown + carried) * belief.probability;
  belief.moment = another * deviation;
  belief.pose_moment = another * (deviation_ + deviation);

  std::ostringstream words;
  if (found.rival && rivals >= std::max({misled, shown, carried})) {
    words << "two motions in view, of " << found.agreement.inliers << " and " << found.rival->matches
          << " matches, the second with a probability of " << found.rival->probability
          << (found.rival->is_torn ? ", above and below a row: are the images torn or damaged?"
                                   : ": does something move in front of the camera?");
  } else if (misled >= std::max(shown, carried)) {
    words << innovationWords(found) << ": followed with a probability of " << 1.0 - belief.probability
          << " is something else";
  } else {
    words << (shown >= carried ? cause_ : "a moment ago " + before.cause)
          << ": the motion is wrong with a probability of " << 1.0 - belief.probability;
  }
  belief.reason = words.str();
  raise(std::log(rivals + misled), !found.rival || rivals < misled ? "the motion changed faster than a vehicle's can"
                                   : found.rival->is_torn          ? "the images seemed to be torn or damaged"
                                                                   : "something else moved in view");
  if (lasts()) deviation_ += deviation;
  return belief;
}

std::string innovationWords(const MotionHypothesis& found) {
  std::ostringstream words;
  words << "the motion differs from the prior by " << std::sqrt(found.innovation)
        << " standard deviations (tracking/acceleration), " << found.agreement.lasting_inliers << " of "
        << found.agreement.lasting_matches << " lasting points agree";
  return words.str();
}

}  // namespace sdvo
