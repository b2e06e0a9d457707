#pragma once

#include <string>
#include <vector>

#include "motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// Something that may have misled a pair: log-odds that it did, and in words.
struct Evidence {
  double log_odds;
  std::string cause;
  bool lasts = false;  ///< the next pairs may follow it, too; else it ends with the pair
};

/// Posterior of a pair's motion.
struct Belief {
  double probability = 1.0;  ///< that it is the camera's
  /// Second moment (m and rad) of its error where it is not, times the probability of that.
  /// The pose's is summed since the doubt began.
  Matrix6d moment = Matrix6d::Zero(), pose_moment = Matrix6d::Zero();
  std::string reason;  ///< in words, of the likeliest alternative
};

/// The doubt that pairs leave to those after them: log-odds that what is followed is not the camera's motion, or not in
/// a sound map. It is one event, from the pair that raised it until it has faded or lasting points refute it: these
/// were confirmed before.
class Doubt {
 public:
  double logOdds() const { return log_odds_; }
  /// Whether it is still twice as likely as without a cause.
  bool lasts() const;

  /// Posterior of a motion: its rivals, the prior, what the pair itself shows and what the pairs before left.
  Belief weigh(const MotionScene& scene, const MotionHypothesis& found, const std::vector<Evidence>& evidence);
  /// A pair without a measured motion shows only this.
  void raise(const std::vector<Evidence>& evidence);
  /// A pair is over: what is followed may end to be so.
  void fade();

 private:
  void raise(double odds, const std::string& cause);

  double log_odds_ = kUnsuspected;
  std::string cause_;                    ///< in words, of the largest odds since it began
  double largest_ = 0.0;                 ///< these odds
  double distance_ = 0.0, angle_ = 0.0;  ///< by which the pose is off if the doubt is right, m and rad
};

/// The pair's own evidence against its motion.
std::string innovationWords(const MotionHypothesis& found);

}  // namespace sdvo
