#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "../belief/motion_prior.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"

namespace sdvo {

/// The guess's motion over `dt` s; a gyro's gets the translation of the prior.
Eigen::Isometry3d motionBy(const MotionGuess& guess, const MotionPrior& prior, double dt);

/// Time since the last measured motion, pairs that were predicted, and the motion by guesses meanwhile.
class Outage {
 public:
  /// Motion since the last pose by guesses alone, m and rad.
  struct GuessedMotion : ExpectedMotion {
    bool rotation_only = false;  ///< the translation is the prior's
  };

  /// Adds a pair `dt` s after the previous one, and the guess of the motion between them, if there is one.
  void extend(double dt, const std::optional<MotionGuess>& guess, const MotionPrior& prior);

  /// None if a guess is missing since the last pose.
  const std::optional<GuessedMotion>& guessedMotion() const { return guessed_motion_; }

  double seconds() const { return seconds_; }
  /// Covariance, m^2 and rad^2, by which the unknown motion of the outage grew in the last `dt` s.
  Matrix6d growth(const MotionPrior& prior, double dt) const {
    return prior.outageCovariance(seconds_) - prior.outageCovariance(seconds_ - dt);
  }

  int predictedPairs() const { return predicted_pairs_; }
  void countPrediction() { ++predicted_pairs_; }

  /// Left and right of a pair did not belong together.
  void noteRefused() { has_refused_ = true; }
  bool hasRefused() const { return has_refused_; }

  /// The pair has a pose, and guessedMotion() begins there.
  void havePose() { guessed_motion_ = GuessedMotion(); }
  /// There is no guessedMotion() until havePose().
  void missGuess() { guessed_motion_.reset(); }
  /// The pair's motion is measured.
  void end();

 private:
  Matrix6d covarianceOf(const MotionGuess& guess, const Matrix6d& process_noise);

  std::optional<GuessedMotion> guessed_motion_ = GuessedMotion();
  double distance_ = 0.0, angle_ = 0.0;  ///< sums over the outage's guesses, m and rad
  double seconds_ = 0.0;
  int predicted_pairs_ = 0;
  bool has_refused_ = false;
};

}  // namespace sdvo
