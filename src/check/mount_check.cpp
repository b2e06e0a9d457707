#include "mount_check.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

Finding MountCheck::judge(double tilt_sigma) const {
  constexpr double kEnough = 1.0;    // m of way (chosen)
  constexpr double kProved = 5.0;    // standard deviations of the estimated tilt (chosen)
  constexpr double kRelevant = 2.0;  // standard deviations by which the mount on TF is trusted (chosen)
  constexpr double kDegree = M_PI / 180.0, kMost = 25.0;  // rad; deg, also of the wide prior: more is another axis
  if (tilt_.distance() < kEnough) return {Verdict::kOpen, "too short a way", "drive two metres, with a turn"};
  const double sigma = tilt_sigma * kDegree;
  auto [tilt, covariance] = tilt_.estimate(kMost * kDegree);
  const auto deviation = [&variances = covariance](int axis) { return std::sqrt(variances(axis, axis)); };
  const auto isWrong = [&, &normal = tilt](int axis) {
    const double angle = std::abs(std::atan(normal[axis]));
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
  const Eigen::Matrix3d R = upright * tilt_.mount().linear() * R_link_optical.transpose();
  return {
      Verdict::kWarn, what,
      text(4, "the camera's mount on TF is wrong, or the floor is none: rpy of a camera link that looks along x is ",
           std::atan2(R(2, 1), R(2, 2)), " ", -std::asin(std::clamp(R(2, 0), -1.0, 1.0)), " ",
           std::atan2(R(1, 0), R(0, 0)), " rad with a right mount (mount_rpy, URDF)")};
}

}  // namespace sdvo
