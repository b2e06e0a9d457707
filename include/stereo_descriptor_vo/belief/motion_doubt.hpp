#pragma once

#include <cmath>
#include <string>

#include "stereo_descriptor_vo/belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// Log-odds that what is followed is not the camera's motion, or not in a sound map. They fade from pair to pair.
class CarriedDoubt {
 public:
  double logOdds() const { return log_odds_; }
  /// Whether it is still twice as likely as without a cause.
  bool lasts() const { return log_odds_ > kUnsuspected + std::log(2.0); }
  /// In words, of the largest doubt that lasts.
  const std::string& cause() const { return cause_; }

  /// Evidence of this pair.
  void raise(double log_odds, const std::string& cause);
  /// A pair is over.
  void pass();

  /// Of a pair that nothing speaks against.
  static constexpr double kUnsuspected = -6.9;  // probability of 0.001 (chosen)
  /// Of an event that leaves a wrong map or a wrong rig.
  static constexpr double kCertain = -kUnsuspected;

 private:
  double log_odds_ = kUnsuspected;
  std::string cause_;
};

/// Whether a motion is the camera's: it may be a rival's, the pair itself may mislead, or a pair before did.
struct MotionDoubt {
  double probability = 1.0;  ///< that it is
  double log_odds = 0.0;     ///< that it is not, by the pair alone
  /// Second moment of the prior around the motion, m and rad, times the probability that the motion is misled.
  Matrix6d moment = Matrix6d::Zero();
  std::string reason, cause;  ///< in words, of the likeliest alternative, for this pair and for the next

  MotionDoubt(const MotionScene& scene, const MotionHypothesis& found, const CarriedDoubt& before);
};

/// The pair's own evidence against its motion.
std::string innovationWords(const MotionHypothesis& found);

}  // namespace sdvo
