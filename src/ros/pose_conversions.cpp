#include "pose_conversions.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <locale>
#include <sstream>
#include <stdexcept>

namespace sdvo::ros_conversions {
namespace {

/// The rotation of the six axes of a perturbation.
Matrix6d rotation(const Eigen::Isometry3d& T) {
  Matrix6d both = Matrix6d::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = T.linear();
  return both;
}

}  // namespace

Eigen::Isometry3d toPose(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double x, y, z, roll, pitch, yaw;
  if (!(stream >> x >> y >> z >> roll >> pitch >> yaw) || !(stream >> std::ws).eof())
    throw std::invalid_argument("'" + text + "' is no pose: six numbers 'x y z roll pitch yaw' (m, rad) are expected");
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

Eigen::Isometry3d toPose(const geometry_msgs::Pose& message) {
  constexpr double kUnitLength = 1e-3;
  const auto& p = message.position;
  const auto& q = message.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
    throw std::invalid_argument("the position is not finite");
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitLength))
    throw std::invalid_argument("the quaternion has not unit length");
  return Eigen::Translation3d(p.x, p.y, p.z) * rotation.normalized();
}

geometry_msgs::PoseWithCovariance toMessage(const Eigen::Isometry3d& pose, const Matrix6d& covariance) {
  geometry_msgs::PoseWithCovariance message;
  message.pose = tf2::toMsg(pose);
  const Matrix6d in_parent = rotation(pose) * covariance * rotation(pose).transpose();
  Eigen::Map<Matrix6d>(message.covariance.data()) = 0.5 * (in_parent + in_parent.transpose());
  return message;
}

void fromMessage(const geometry_msgs::PoseWithCovariance& message, Eigen::Isometry3d& pose, Matrix6d& covariance) {
  pose = toPose(message.pose);
  const Matrix6d in_parent = Eigen::Map<const Matrix6d>(message.covariance.data()).transpose();  // it has rows
  if (!in_parent.allFinite() || in_parent.llt().info() != Eigen::Success)
    throw std::invalid_argument("a covariance is not finite or not positive");
  covariance = rotation(pose).transpose() * in_parent * rotation(pose);
}

}  // namespace sdvo::ros_conversions
