#include "stereo_descriptor_vo/odometry/motion_doubt.hpp"

#include <algorithm>
#include <opencv2/core.hpp>

namespace sdvo {
namespace {

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
  const double way = velocity.head<3>().norm() * seconds + 0.5 * kLastingAcceleration * seconds * seconds;
  const double angle = velocity.tail<3>().norm() * seconds + 0.5 * kLastingTurnAcceleration * seconds * seconds;
  return covarianceOf(std::min(way, max_speed * seconds), std::min(angle, CV_PI));
}

Matrix6d disagreement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Vector6d difference = logSE3(a.inverse() * b);
  return covarianceOf(difference.head<3>().norm(), difference.tail<3>().norm());
}

}  // namespace sdvo
