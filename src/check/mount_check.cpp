#include "mount_check.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

void MountCheck::Sums::add(const Eigen::Vector2d& row, double value) {
  square += row * row.transpose();
  product += row * value;
  rest += value * value;
  ++count;
}

double MountCheck::Sums::variance(const Eigen::Vector2d& tilt) const {
  const double residuals = rest - 2.0 * tilt.dot(product) + tilt.dot(square * tilt);
  return std::max(residuals, 0.0) / std::max(count - 2, 1);
}

void MountCheck::add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_before_now) {
  if (!T_base_camera.isApprox(T_base_camera_, 1e-6)) *this = {};
  T_base_camera_ = T_base_camera;
  const Eigen::Isometry3d of_base = T_base_camera * T_before_now * T_base_camera.inverse();
  const Eigen::Vector3d t = of_base.translation(), turn = logSO3(of_base.linear());
  constexpr double kLeast = 1e-3, kLeastTurn = 1e-3;              // m, rad: less is noise
  if (t.norm() > kLeast) translations_.add(t.head<2>(), -t.z());  // along the floor
  distance_ += t.norm();
  if (turn.norm() < kLeastTurn) return;
  for (const int axis : {0, 1}) rotations_.add(turn.z() * Eigen::Vector2d::Unit(axis), turn[axis]);  // about its normal
}

Finding MountCheck::judge(double tilt_sigma) const {
  constexpr double kEnough = 1.0;    // m of way (chosen)
  constexpr double kProved = 5.0;    // standard deviations of the estimated tilt (chosen)
  constexpr double kRelevant = 2.0;  // standard deviations by which the mount on TF is trusted (chosen)
  constexpr double kDegree = M_PI / 180.0, kUnknown = 1e6, kMost = 25.0;  // rad; deg: more is another axis
  if (distance_ < kEnough) return {Verdict::kOpen, "too short a way", "drive two metres, with a turn"};
  const double sigma = tilt_sigma * kDegree;
  constexpr double kNoise = 1e-4, kNoiseTurn = 1e-4;  // m, rad (chosen): at least
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = kUnknown * Eigen::Matrix2d::Identity();
  constexpr int kPasses = 3;  // for the weights
  for (int pass = 0; pass < kPasses; ++pass) {
    const double of_translations = std::max(translations_.variance(tilt), kNoise * kNoise);
    const double of_rotations = std::max(rotations_.variance(tilt), kNoiseTurn * kNoiseTurn);
    const Eigen::Matrix2d information = translations_.square / of_translations + rotations_.square / of_rotations +
                                        Eigen::Matrix2d::Identity() / (kMost * kDegree * kMost * kDegree);
    covariance = information.inverse();
    tilt = covariance * (translations_.product / of_translations + rotations_.product / of_rotations);
  }
  const auto deviation = [&](int axis) { return std::sqrt(covariance(axis, axis)); };
  const auto isWrong = [&](int axis) {
    const double angle = std::abs(std::atan(tilt[axis]));
    return angle > kRelevant * sigma && angle > kProved * deviation(axis) && angle < kMost * kDegree;
  };
  const bool is_wrong = isWrong(0) || isWrong(1);
  std::string what;
  for (const auto& [axis, how, sign] : {std::tuple(0, "pitched down by ", -1.0), std::tuple(1, "rolled by ", 1.0)}) {
    // A way without turns shows the tilt along it, but not the one across it.
    const bool is_known = isWrong(axis) || deviation(axis) < kRelevant * sigma;
    if (!is_known) tilt[axis] = 0.0;
    if (is_known)
      what += text(1, what.empty() ? "by the floor the camera is " : " and ", how,
                   sign * std::atan(tilt[axis]) / kDegree, " +- ", deviation(axis) / kDegree, " deg more");
  }
  if (what.empty()) return {Verdict::kOpen, "the floor shows no tilt yet", "drive two metres, with a turn"};
  what += " than on TF";
  if (!is_wrong) return {Verdict::kOk, what};
  const Eigen::Vector3d normal = Eigen::Vector3d(tilt.x(), tilt.y(), 1.0).normalized();
  const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(normal, Eigen::Vector3d::UnitZ());
  Eigen::Matrix3d R_link_optical;  // a link looks along x
  R_link_optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  const Eigen::Matrix3d R = upright * T_base_camera_.linear() * R_link_optical.transpose();
  return {
      Verdict::kWarn, what,
      text(4, "the camera's mount on TF is wrong, or the floor is none: rpy of a camera link that looks along x is ",
           std::atan2(R(2, 1), R(2, 2)), " ", -std::asin(std::clamp(R(2, 0), -1.0, 1.0)), " ",
           std::atan2(R(1, 0), R(0, 0)), " rad with a right mount (mount_rpy, URDF)")};
}

}  // namespace sdvo
