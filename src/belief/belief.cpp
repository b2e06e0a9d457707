#include "belief.hpp"

#include <cmath>

#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Words on where a motion is in the image: the number of its features, and the mean of their positions.
std::string placeWords(const StereoFeatures& features, const std::vector<int>& matched) {
  double u = 0.0, v = 0.0;
  for (const int i : matched) u += features.u[i], v += features.v[i];
  const double count = std::max(static_cast<double>(matched.size()), 1.0);
  return text(0, matched.size(), " matches around (", u / count, ", ", v / count, ") px");
}

/// Names the two motions in view, if a second one competes; else empty.
std::string rivalWords(const MotionScene& scene, const MotionHypothesis& found) {
  if (!found.rival) return "";
  return "two motions in view, of " + placeWords(scene.features, found.inlierFeatures()) + " and of " +
         placeWords(scene.features, found.rival->features) +
         (found.rival->is_torn ? ", above and below a row: are the images torn or damaged?"
                               : ": does something move in front of the camera?");
}

/// Log of the odds beyond exp(kUnsuspected). logOddsWrong() counts the odds without evidence once; each evidence would
/// count them again.
double logExcess(double log_odds) {
  return std::log(std::exp(log_odds) - std::exp(kUnsuspected));
}

}  // namespace

bool Doubt::lasts() const {
  return log_odds_ > kUnsuspected + std::log(2.0);
}

/// Adds the odds beyond those without evidence. Causes exclude each other, so their odds add up.
void Doubt::raise(double odds, const std::string& cause) {
  const double unsuspected = std::exp(kUnsuspected);
  if (!(odds > unsuspected)) return;
  log_odds_ = std::clamp(std::log(std::exp(log_odds_) + odds - unsuspected), kUnsuspected, kCertain);
  if (odds > largest_) largest_ = odds, cause_ = cause;
}

void Doubt::raise(const std::vector<Evidence>& evidence) {
  for (const Evidence& each : evidence)
    if (each.lasts) raise(std::exp(each.log_odds), each.cause);
}

void Doubt::fade(double seconds) {
  // s (chosen by lab/run faults and healthy cars at 5 Hz): with 0.2 s a mover over most of the view is believed, from
  // 0.3 s on the cars are doubted.
  constexpr double kHalfLife = 0.25;
  setLogOdds(kUnsuspected + (log_odds_ - kUnsuspected) * std::exp2(-seconds / kHalfLife));
}

/// Once the doubt no longer lasts, the next evidence names its cause, and errors add up anew.
void Doubt::setLogOdds(double log_odds) {
  log_odds_ = log_odds;
  if (!lasts()) distance_ = angle_ = largest_ = 0.0;
}

Belief Doubt::update(const MotionScene& scene, const MotionHypothesis& found, const std::vector<Evidence>& evidence) {
  // Lasting points that agree refute the doubt of earlier pairs.
  if (lasts()) setLogOdds(std::clamp(log_odds_ - logAgreement(found.agreement), kUnsuspected, kCertain));

  // A wrong motion errs by its difference from the prior's motion; without a prior, by that from standstill. This is
  // the second moment of that error.
  const ExpectedMotion expected = scene.prior.empty() ? ExpectedMotion() : scene.prior.front();
  const Vector6d innovation = expected.innovation(found.motion.T_current_reference.inverse());
  const Matrix6d deviation = momentOf(innovation) + expected.covariance;
  const double log_odds_rivals = std::min(-sdvo::logOdds(found.probability), kCertain);
  const double log_odds_wrong = logOddsWrong(found);  // without a rival
  MotionMixture mixture;
  // The moment of the rivals is found.rivals_moment.
  mixture.add({log_odds_rivals, Matrix6d::Zero(), rivalWords(scene, found)});
  mixture.add({log_odds_wrong, deviation, innovationWords(found) + ": followed is something else"});
  for (const Evidence& each : evidence)
    if (each.log_odds > kUnsuspected) mixture.add({logExcess(each.log_odds), deviation, each.cause});
  mixture.add({log_odds_, deviation, "a moment ago " + cause_});  // without doubt a thousandth, which does not matter
  Belief belief;
  belief.probability = mixture.probability();
  belief.moment = mixture.moment();
  belief.reason =
      text(4, mixture.likeliest().cause, ": the motion is wrong with a probability of ", 1.0 - belief.probability);

  // The pair's evidence is carried to the next ones.
  raise(evidence);
  raise(std::exp(log_odds_rivals) + std::exp(log_odds_wrong),
        !found.rival || log_odds_rivals < log_odds_wrong ? "the motion changed faster than a vehicle's can"
        : found.rival->is_torn                           ? "the images seemed to be torn or damaged"
                                                         : "something else moved in view");

  // Errors of successive motions that follow one mover add up in the pose.
  double distance = distance_ + std::sqrt(deviation.topLeftCorner<3, 3>().trace() / 3.0);
  double angle = angle_ + std::sqrt(deviation.bottomRightCorner<3, 3>().trace() / 3.0);
  const double wrong_without_rivals = 1.0 - belief.probability - mixture.probability(log_odds_rivals);
  belief.pose_moment = wrong_without_rivals * isotropic(distance * distance, angle * angle);
  if (lasts()) distance_ = distance, angle_ = angle;
  return belief;
}

std::string innovationWords(const MotionHypothesis& found) {
  return text(2, "the motion differs from the prior by ", std::sqrt(found.innovation),
              " standard deviations (tracking/acceleration), ", found.agreement.lasting_inliers, " of ",
              found.agreement.lasting_matches, " lasting points agree");
}

}  // namespace sdvo
