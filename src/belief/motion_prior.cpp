#include "motion_prior.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "../common/text.hpp"

namespace sdvo {

Matrix6d momentOf(const Vector6d& difference) {
  return isotropic(difference.head<3>().squaredNorm(), difference.tail<3>().squaredNorm());
}

double ExpectedMotion::normalisedSquare(const Eigen::Isometry3d& measured, const Matrix6d& measured_covariance) const {
  const Vector6d difference = innovation(measured);
  return mahalanobisSquare(difference, covariance + measured_covariance);
}

/// Mean velocities over neighbouring intervals T1, T2 differ with the variance a^2 (T1 + T2) / 3. That is at most two
/// thirds of a^2 times the longer interval.
Matrix6d MotionPrior::processNoise(double dt, double before, double age) const {
  const double seconds_cubed = (2.0 / 3.0 * std::max(before, dt) + age) * dt * dt;
  return isotropic(options_.acceleration * options_.acceleration * seconds_cubed,
                   options_.rotation_acceleration * options_.rotation_acceleration * seconds_cubed);
}

/// The error is that of (t2 - t1) - (t1 - t0): six times the variance of a stamp.
Matrix6d MotionPrior::stampNoise(const Vector6d& velocity) const {
  const Vector6d shift = std::sqrt(6.0) * options_.stamp_sigma * velocity;
  return shift * shift.transpose();
}

void MotionPrior::noteInterval(double dt) {
  constexpr double kMean = 1.0 / (1.0 - kUsualMemory);  // intervals
  counted_intervals_ = std::min(counted_intervals_ + 1.0, kMean);
  mean_interval_ += (dt - mean_interval_) / counted_intervals_;
  longest_interval_ = std::max(dt, kUsualMemory * longest_interval_);
}

double MotionPrior::interval(double dt) const {
  constexpr double kBurst = 0.2;  // ratio of the mean interval (chosen): a camera does not change its rate by as much
  return dt < kBurst * mean_interval_ ? longest_interval_ : dt;
}

double MotionPrior::interval(double dt, const Eigen::Isometry3d& motion) const {
  return std::max({interval(dt), motion.translation().norm() / options_.max_speed,
                   logSO3(motion.linear()).norm() / options_.max_rotation_rate});
}

ExpectedMotion MotionPrior::predicted(double dt) const {
  // Stamps of a burst are closer together than the moments at which its pairs were taken.
  const double time = std::max(dt, longest_interval_);
  const Vector6d missed = last_->value * (time - dt);
  return {expSE3(last_->value * dt), processNoise(time, last_->interval, 0.0) + missed * missed.transpose() +
                                         time * time * last_->covariance + doubt_};
}

std::optional<ExpectedMotion> MotionPrior::priorByConfirmed(std::int64_t stamp, double dt) const {
  if (!confirmed_) return std::nullopt;
  const double age = static_cast<double>(stamp - confirmed_->stamp) * 1e-9;
  const ExpectedMotion expected{expSE3(confirmed_->value * dt),
                                processNoise(withStampErrors(dt), withStampErrors(confirmed_->interval), age) +
                                    stampNoise(confirmed_->value) + dt * dt * confirmed_->covariance};
  const double error = std::sqrt(expected.covariance.topLeftCorner<3, 3>().trace());
  return error < options_.max_speed * options_.max_gap ? std::optional(expected) : std::nullopt;
}

ExpectedMotion MotionPrior::around(const Eigen::Isometry3d& motion, double dt) const {
  const double time = withStampErrors(dt);
  return {motion, processNoise(time, time, 0.0)};
}

double MotionPrior::logRatioOfSwap(const Eigen::Isometry3d& motion, double dt) const {
  if (!last_ || !before_last_) return 0.0;
  // In the right order the velocities are before, last, now. In the wrong one: before, `swapped_first` (the last
  // motion and this one, which leads back), -now.
  const Vector6d second = logSE3(motion), now = second / dt;
  const Vector6d swapped_first = last_->value + second / last_->interval;
  const Matrix6d measured = 2.0 * dt * dt * last_->covariance;  // of two motions
  // Of a change of the velocity, bounded by the probability that the prior is wrong.
  const auto cost = [&](const Vector6d& from, const Vector6d& to) {
    const double square = around(expSE3(from * dt), dt).normalisedSquare(expSE3(to * dt), measured);
    return std::min(0.5 * square, -std::log(kTailProbability));
  };
  const Vector6d &before = before_last_->value, &last = last_->value;
  return cost(before, last) + cost(last, now) - cost(before, swapped_first) - cost(swapped_first, -now);
}

Matrix6d MotionPrior::outageCovariance(double seconds) const {
  const Vector6d velocity = confirmed_ ? confirmed_->value : Vector6d(Vector6d::Zero());
  const auto spread = [&](double speed, double acceleration, double most) {
    const double t = seconds;
    return std::min(speed * speed * t * t + acceleration * acceleration * t * t * t / 3.0, most * most);
  };
  return isotropic(spread(velocity.head<3>().norm(), options_.acceleration, options_.max_speed * seconds),
                   spread(velocity.tail<3>().norm(), options_.rotation_acceleration, CV_PI));
}

Matrix6d MotionPrior::lastStepCovariance(double seconds, double dt) const {
  const Vector6d velocity = confirmed_ ? confirmed_->value : Vector6d(Vector6d::Zero());
  const auto spread = [&](double speed, double acceleration, double most) {
    return std::min(speed * speed + acceleration * acceleration * seconds, most * most) * dt * dt;
  };
  return isotropic(spread(velocity.head<3>().norm(), options_.acceleration, options_.max_speed),
                   spread(velocity.tail<3>().norm(), options_.rotation_acceleration, options_.max_rotation_rate));
}

Matrix6d MotionPrior::unmeasuredCovariance() const {
  constexpr double kTurn = 0.5;  // rad (chosen)
  const double farthest = options_.max_speed * options_.max_gap;
  return isotropic(farthest * farthest, kTurn * kTurn);
}

std::string MotionPrior::tooFast(const Eigen::Isometry3d& motion, const Matrix6d& covariance, double dt) const {
  const double sigmas = std::sqrt(noiseGate(1));
  const double time = dt + sigmas * options_.stamp_sigma;
  const auto noise = [&](int first) { return sigmas * std::sqrt(covariance.block<3, 3>(first, first).trace()); };
  const double distance = motion.translation().norm(), angle = logSO3(motion.linear()).norm();
  if (!(distance <= options_.max_speed * time + noise(0)))
    return text(1, "a speed of ", distance / dt, " m/s exceeds tracking/max_speed");
  if (!(angle <= options_.max_rotation_rate * time + noise(3)))
    return text(1, "a rotation of ", angle / dt, " rad/s exceeds ", options_.max_rotation_rate, " rad/s");
  return "";
}

void MotionPrior::takeVelocity(std::int64_t stamp, const Eigen::Isometry3d& motion, double by_stamps,
                               const Matrix6d& covariance, bool is_confirmed, const Matrix6d& doubt) {
  doubt_ = doubt;
  const double dt = interval(by_stamps);
  const Vector6d velocity = logSE3(motion) / dt;
  // The error of stamps may make a motion too fast, but such a velocity predicts no other motion.
  if (!(velocity.head<3>().norm() <= options_.max_speed) || !(velocity.tail<3>().norm() <= options_.max_rotation_rate))
    return;
  before_last_ = std::exchange(last_, Velocity{velocity, covariance / (dt * dt), dt, stamp});
  if (is_confirmed || !confirmed_) confirmed_ = last_;
}

}  // namespace sdvo
