#include "outage.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sdvo {

void MotionGuess::check() const {
  checkRigid(T_previous_current, "the guess of the motion");
  if (!(error > 0.0) || !std::isfinite(error))
    throw std::invalid_argument("the error of the guess is " + std::to_string(error) +
                                ", not a positive ratio of the motion");
}

Eigen::Isometry3d motionBy(const MotionGuess& guess, const MotionPrior& prior, double dt) {
  Eigen::Isometry3d motion = guess.T_previous_current;
  if (guess.rotation_only) motion.translation() = prior.velocity().value_or(Vector6d::Zero()).head<3>() * dt;
  return motion;
}

void Outage::extend(double dt, const std::optional<MotionGuess>& guess, const MotionPrior& prior) {
  seconds_ += dt;
  if (!guess) missGuess();
  if (!guessed_motion_) return;
  const Eigen::Isometry3d motion = motionBy(*guess, prior, dt);
  Matrix6d covariance = covarianceOf(*guess, prior.around(motion, dt).covariance);
  if (guess->rotation_only) covariance.topLeftCorner<3, 3>() = growth(prior, dt).topLeftCorner<3, 3>();
  guessed_motion_->motion = guessed_motion_->motion * motion;
  guessed_motion_->covariance = carried(motion.inverse(), guessed_motion_->covariance) + covariance;
  guessed_motion_->rotation_only |= guess->rotation_only;
}

/// Covariance that a guess adds to those before it. A scale error's standard deviation is proportional to the whole
/// distance. Each guess counts for some distance, because no odometry at rest is exact.
Matrix6d Outage::covarianceOf(const MotionGuess& guess, const Matrix6d& process_noise) {
  constexpr double kLeast = 0.02;  // of the process noise's standard deviation (chosen): 1 mm at 10 Hz
  Vector6d motion = logSE3(guess.T_previous_current);
  if (guess.rotation_only) motion.head<3>().setZero();
  const auto grow = [&](double& path, double by, double variance) {
    const double before = path;
    path += std::max(by, kLeast * std::sqrt(variance));
    return guess.error * guess.error * (path * path - before * before);
  };
  Vector6d variance;
  variance.head<3>().setConstant(grow(distance_, motion.head<3>().norm(), process_noise(0, 0)));
  variance.tail<3>().setConstant(grow(angle_, motion.tail<3>().norm(), process_noise(3, 3)));
  return variance.asDiagonal();
}

void Outage::end() {
  distance_ = angle_ = seconds_ = 0.0;
  predicted_pairs_ = 0;
  has_refused_ = false;
}

}  // namespace sdvo
