#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// Something that may have misled a pair's motion.
struct Evidence {
  /// `unbounded`: log-odds that it did. They are bounded by kCertain: nothing is more certain than the model behind it.
  Evidence(double unbounded, std::string named, bool may_last = false)
      : log_odds(unbounded > kUnsuspected ? std::min(unbounded, kCertain) : kUnsuspected),
        cause(std::move(named)),
        lasts(may_last) {}

  double log_odds;
  std::string cause;
  bool lasts;  ///< it may mislead the next pairs, too; else it ends with the pair
};

/// Posterior of a pair's motion.
struct Belief {
  double probability = 1.0;  ///< that the motion is the camera's
  /// Second moment of the motion's error over all alternatives but the rivals, which have `rivals_moment`, m and rad.
  Matrix6d moment = Matrix6d::Zero();
  /// The same of the pose: errors since the doubt began add up.
  Matrix6d pose_moment = Matrix6d::Zero();
  std::string reason;  ///< names the likeliest alternative
};

/// Carried doubt: log-odds from earlier pairs that the motion is not the camera's, or that the map is wrong. A doubt is
/// one event. It ends when it has faded, or when lasting points refute it.
class Doubt {
 public:
  double logOdds() const { return log_odds_; }
  /// Whether its odds are more than twice those without a cause.
  bool lasts() const;

  /// Posterior of a motion, by its rivals, the prior, the pair's own evidence and the carried doubt, which is updated.
  Belief update(const MotionScene& scene, const MotionHypothesis& found, const std::vector<Evidence>& evidence);
  /// Adds the evidence of a pair without a measured motion.
  void raise(const std::vector<Evidence>& evidence);
  /// Lets the doubt fade over so many seconds: a mover may leave the view.
  void fade(double seconds);

 private:
  void raise(double odds, const std::string& cause);
  void setLogOdds(double log_odds);

  double log_odds_ = kUnsuspected;
  std::string cause_;                    ///< that with the largest odds since the doubt began
  double largest_ = 0.0;                 ///< its odds
  double distance_ = 0.0, angle_ = 0.0;  ///< error of the pose if the doubt is right, m and rad
};

/// The innovation and the lasting points' agreement, in words.
std::string innovationWords(const MotionHypothesis& found);

}  // namespace sdvo
