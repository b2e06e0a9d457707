#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "stereo_descriptor_vo/belief/motion_prior.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// How the camera moved since the pair before, as something else than the images has it.
struct MotionGuess {
  Eigen::Isometry3d T_previous_current = Eigen::Isometry3d::Identity();
  bool rotation_only = false;  ///< a gyro's: of the translation it says nothing
  double error =
      0.1;  ///< standard deviation of distance and turn, as ratios of them; it is a scale: all guesses share it

  /// The motion over `dt` s. The translation that a gyro lacks is the prior's.
  Eigen::Isometry3d motion(const MotionPrior& prior, double dt) const;
};

/// The pairs since the last measured motion, and what guesses have of the motion meanwhile.
class Outage {
 public:
  /// Motion since the last pose, m and rad.
  struct Followed : ExpectedMotion {
    bool rotation_only = false;  ///< the translation is the prior's
  };

  /// A pair comes `dt` s after the one before, with a guess of the motion between them, or with none.
  void extend(double dt, const std::optional<MotionGuess>& guess, const MotionPrior& prior);

  /// As guesses have it; nothing while one is missing since the last pose.
  const std::optional<Followed>& followed() const { return followed_; }

  /// The covariance by which the unseen motion grew over the last `dt` s.
  Matrix6d growth(const MotionPrior& prior, double dt) const;

  int predictedPairs() const { return predicted_pairs_; }
  void countPrediction() { ++predicted_pairs_; }

  /// The pair has a pose: guesses are followed from there on.
  void havePose() { followed_ = Followed(); }
  /// The pair's motion is measured.
  void end();

 private:
  Matrix6d covarianceOf(const MotionGuess& guess, const Matrix6d& process_noise);

  std::optional<Followed> followed_ = Followed();
  double distance_ = 0.0, angle_ = 0.0;  ///< of the guesses, m and rad
  double seconds_ = 0.0;
  int predicted_pairs_ = 0;
};

}  // namespace sdvo
