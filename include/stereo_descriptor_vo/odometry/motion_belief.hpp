#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// Accelerations that a vehicle exceeds for moments only (chosen: a car that brakes hard, a robot that turns fast).
/// They are the process noise of a predicted motion.
constexpr double kLastingAcceleration = 5.0;      // m/s^2
constexpr double kLastingTurnAcceleration = 2.0;  // rad/s^2

/// Covariances, of right perturbations in m and rad, of motions that were not measured or not for certain.

/// Uncertainty that a prediction adds to the velocity it starts from, `dt` in s. The mean velocities of two intervals
/// of `dt` differ by the acceleration above times `dt`, so the motions differ by that times `dt` once more.
Matrix6d predictionCovariance(double dt);

/// Of an unseen motion that began with this velocity, m/s and rad/s, and accelerated as above. Its speed is at most
/// `max_speed`, m/s.
Matrix6d travelCovariance(const Vector6d& velocity, double seconds, double max_speed);

/// As large in every direction as two motions differ.
Matrix6d disagreement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

/// How the camera is believed to move. The velocity of the last measured pair predicts the next motion. The last
/// trusted velocity, which was not in doubt, is what later motions are compared with.
class MotionBelief {
 public:
  /// Takes note of the time since the pair before, s. Gaps longer than that over which motions are predicted are none.
  void pass(double dt);

  /// Of the camera in its own frame, m/s and rad/s; none where no motion can be predicted.
  const std::optional<Vector6d>& velocity() const { return velocity_; }
  const std::optional<Vector6d>& trusted() const { return trusted_; }
  /// Time from the pair in which the trusted velocity was measured, s.
  double trustedAge(std::int64_t stamp) const;

  /// T_previous_current as the trusted velocity has it; it stands still where that is unknown.
  Eigen::Isometry3d expected(double dt) const;

  /// T_previous_current as the velocity, which must be known, predicts it, and the covariance of that.
  Eigen::Isometry3d predicted(double dt) const;
  Matrix6d predictedCovariance(double dt) const;

  /// Takes over a measured velocity with the covariance of its motion over `dt` s. A velocity in doubt predicts the
  /// next pair, but does not replace a trusted one of the last two seconds.
  void measure(std::int64_t stamp, const Vector6d& velocity, double dt, const Matrix6d& covariance, bool is_trusted);

  /// Covariance of what the last measured motion is doubted by; zero where it is not.
  void doubt(const Matrix6d& covariance) { doubt_ = covariance; }

  /// The next pair does not continue the last one: no motion is predicted. The trusted velocity stays.
  void interrupt() { velocity_.reset(); }

  /// As interrupt(), and the trusted velocity is unknown, too.
  void forget();

 private:
  std::optional<Vector6d> velocity_, trusted_;
  std::int64_t trusted_stamp_ = 0;                   ///< ns
  Matrix6d velocity_covariance_ = Matrix6d::Zero();  ///< 1/s^2
  Matrix6d doubt_ = Matrix6d::Zero();
  double interval_ = 0.0;  ///< the longest time between two of the last pairs, s
};

}  // namespace sdvo
