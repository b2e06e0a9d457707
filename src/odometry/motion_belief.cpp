#include "stereo_descriptor_vo/odometry/motion_belief.hpp"

#include <algorithm>
#include <opencv2/core.hpp>

namespace sdvo {
namespace {

constexpr double kForgotten = 0.2;  // ratio of the interval, by each pair: it outlives bursts of three (chosen)
constexpr double kTrusted = 2.0;    // s that a trusted velocity outlives motions in doubt (chosen: a car stops in less)

Matrix6d covarianceOf(double translation, double rotation) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variance.asDiagonal();
}

}  // namespace

Matrix6d predictionCovariance(double dt) {
  return covarianceOf(kLastingAcceleration * dt * dt, kLastingTurnAcceleration * dt * dt);
}

Matrix6d travelCovariance(const Vector6d& velocity, double seconds, double max_speed) {
  const double distance = velocity.head<3>().norm() * seconds + 0.5 * kLastingAcceleration * seconds * seconds;
  const double angle = velocity.tail<3>().norm() * seconds + 0.5 * kLastingTurnAcceleration * seconds * seconds;
  return covarianceOf(std::min(distance, max_speed * seconds), std::min(angle, CV_PI));
}

Matrix6d disagreement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Vector6d difference = logSE3(a.inverse() * b);
  return covarianceOf(difference.head<3>().norm(), difference.tail<3>().norm());
}

void MotionBelief::pass(double dt) {
  interval_ = std::max(dt, (1.0 - kForgotten) * interval_);
}

double MotionBelief::trustedAge(std::int64_t stamp) const {
  return static_cast<double>(stamp - trusted_stamp_) * 1e-9;
}

Eigen::Isometry3d MotionBelief::expected(double dt) const {
  return expSE3(trusted_.value_or(Vector6d::Zero()) * dt);
}

Eigen::Isometry3d MotionBelief::predicted(double dt) const {
  return expSE3(*velocity_ * dt);
}

Matrix6d MotionBelief::predictedCovariance(double dt) const {
  // Stamps of a burst are closer together than the moments at which its pairs were taken.
  const double time = std::max(dt, interval_);
  const Vector6d missed = *velocity_ * (time - dt);
  return predictionCovariance(time) + missed * missed.transpose() + time * time * velocity_covariance_ + doubt_;
}

void MotionBelief::measure(std::int64_t stamp, const Vector6d& velocity, double dt, const Matrix6d& covariance,
                           bool is_trusted) {
  velocity_ = velocity;
  velocity_covariance_ = covariance / (dt * dt);
  if (!is_trusted && trusted_ && trustedAge(stamp) <= kTrusted) return;
  trusted_ = velocity;
  trusted_stamp_ = stamp;
}

void MotionBelief::forget() {
  velocity_.reset();
  trusted_.reset();
}

}  // namespace sdvo
