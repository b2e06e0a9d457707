#include "pose_conversions.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <locale>
#include <sstream>
#include <stdexcept>

namespace sdvo::ros_conversions {
namespace {

/// Rotates both halves of a perturbation.
Matrix6d rotation(const Eigen::Isometry3d& T) {
  Matrix6d both = Matrix6d::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = T.linear();
  return both;
}

constexpr const char* kAxes[] = {"x", "y", "z", "roll", "pitch", "yaw"};

/// A symmetric positive covariance from a sender's, which may have one empty triangle. Throws std::invalid_argument if
/// it is invalid.
Matrix6d meantCovariance(const Matrix6d& sent) {
  constexpr double kNone = 1e-6;      // m^2, rad^2, for a variance of zero
  constexpr double kRounding = 1e-3;  // of a correlation, between floats
  constexpr double kLargest = 1e16;   // m^2, rad^2: of the farthest position
  const auto between = [](int i, int j) { return std::string("covariance of ") + kAxes[i] + " and " + kAxes[j]; };
  Matrix6d meant;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) {
      const double lower = sent(i, j), upper = sent(j, i);
      if (!std::isfinite(lower) || !std::isfinite(upper))
        throw std::invalid_argument("the " + between(i, j) + " is not finite: send a number, 0 if it is not known");
      if (i == j && lower > kLargest)
        throw std::invalid_argument(std::string("the covariance's variance of ") + kAxes[i] +
                                    " is beyond 1e16: send at most that for what is not known");
      if (i == j && lower < 0.0)
        throw std::invalid_argument(std::string("the covariance's variance of ") + kAxes[i] +
                                    " is negative: send it in m^2 or rad^2, 0 for 1 mm or 1 mrad");
      meant(i, j) = meant(j, i) = lower == 0.0 ? upper : upper == 0.0 ? lower : 0.5 * (lower + upper);
    }
  meant.diagonal() = (meant.diagonal().array() == 0.0).select(kNone, meant.diagonal());
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j) {
      const double limit = std::sqrt(meant(i, i) * meant(j, j));
      if (std::abs(meant(i, j)) > (1.0 + kRounding) * limit)
        throw std::invalid_argument("the " + between(i, j) +
                                    " exceeds what their variances allow: send |c| <= sigma * sigma");
      if (std::abs(sent(i, j) - sent(j, i)) > kRounding * limit && sent(i, j) != 0.0 && sent(j, i) != 0.0)
        throw std::invalid_argument("the " + between(i, j) + " has two values: send the same in both triangles");
    }
  // Fully correlated axes, or rounding, leave an eigenvalue near zero.
  const double least = Eigen::SelfAdjointEigenSolver<Matrix6d>(meant, Eigen::EigenvaluesOnly).eigenvalues()[0];
  const double largest = meant.diagonal().maxCoeff();
  if (least < -kRounding * largest)
    throw std::invalid_argument(
        "the covariance is not positive: its correlations contradict each other, send 0 for them");
  if (least <= 1e-12 * largest) meant.diagonal().array() += 1e-12 * largest - std::min(least, 0.0);
  return meant;
}

/// Throws std::invalid_argument for a position that is not finite or too far away.
Eigen::Translation3d checked(double x, double y, double z) {
  constexpr double kFarthest = 1e8;  // m; grids of the earth, 4e7 m around it, have no larger coordinates
  for (const double coordinate : {x, y, z}) {
    if (!std::isfinite(coordinate)) throw std::invalid_argument("the position is not finite");
    if (std::abs(coordinate) > kFarthest) throw std::invalid_argument("the position is beyond 1e8 m");
  }
  return {x, y, z};
}

}  // namespace

Eigen::Isometry3d bodyToOptical() {
  return Eigen::Isometry3d(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5));
}

Eigen::Isometry3d toPose(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double x, y, z, roll, pitch, yaw;
  if (!(stream >> x >> y >> z >> roll >> pitch >> yaw) || !(stream >> std::ws).eof())
    throw std::invalid_argument("'" + text + "' is no pose: six numbers 'x y z roll pitch yaw' (m, rad) are expected");
  for (const double angle : {roll, pitch, yaw})
    if (!(std::abs(angle) <= 2.0 * M_PI))
      throw std::invalid_argument("'" + text + "' has an angle beyond 2 pi: give radians, not degrees");
  return checked(x, y, z) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

Eigen::Isometry3d toPose(const geometry_msgs::Pose& message) {
  constexpr double kUnitLength = 1e-3;
  const auto& p = message.position;
  const auto& q = message.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitLength))
    throw std::invalid_argument("the quaternion has not unit length: normalise it (w = 1 and the rest 0: no rotation)");
  return checked(p.x, p.y, p.z) * rotation.normalized();
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
  const Matrix6d in_parent = meantCovariance(Eigen::Map<const Matrix6d>(message.covariance.data()));
  covariance = rotation(pose).transpose() * in_parent * rotation(pose);
}

}  // namespace sdvo::ros_conversions
