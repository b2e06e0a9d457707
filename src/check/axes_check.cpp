#include "axes_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/text.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

void OpticalAxisCheck::add(const Eigen::Isometry3d& T_base_camera, const Eigen::Vector3d& translation) {
  constexpr double kUp = 0.7;  // cosine of 45 degrees
  if (T_base_camera.linear()(2, 2) < kUp) return;
  along_axis_ += translation.z();
  distance_ += translation.norm();
}

Finding OpticalAxisCheck::judge() const {
  constexpr double kEnough = 0.5;  // m (chosen)
  constexpr double kAlong = 0.8;   // ratio (chosen): a robot under a ceiling camera drives across its axis
  const std::string step = "axes";
  if (distance_ < kEnough) return {step, Verdict::kOpen, "no motion of a camera that looks up", ""};
  const std::string what = text(1, "TF has the camera look up, and it moves along its axis by ", along_axis_, " of ",
                                distance_, " m: the robot rises");
  if (std::abs(along_axis_) < kAlong * distance_) return {step, Verdict::kOk, what, ""};
  return {
      step, Verdict::kWarn, what,
      "the images' frame_id names a body's frame (x ahead) instead of an optical one (z ahead), or lacks its rotation"};
}

void GyroAxesCheck::add(const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images) {
  constexpr double kLeast = 0.2 * M_PI / 180.0;  // rad: below it bias and noise turn as much
  const Eigen::Vector3d gyro = logSO3(by_gyro), images = logSO3(by_images);
  if (std::max(gyro.norm(), images.norm()) < kLeast) return;
  product_ += gyro.dot(images);
  of_gyro_ += gyro.squaredNorm();
  of_images_ += images.squaredNorm();
  turned_ += images.norm();
}

Finding GyroAxesCheck::judge() const {
  constexpr double kEnough = 20.0 * M_PI / 180.0;  // rad
  constexpr double kAgree = 0.7, kMost = 2.0;      // cosine; ratio of the rates
  const std::string step = "IMU";
  if (turned_ < kEnough) return {step, Verdict::kOpen, "the camera did not turn enough", "turn it"};
  const double cosine = product_ / std::sqrt(std::max(of_gyro_ * of_images_, 1e-300));
  const double ratio = std::sqrt(of_gyro_ / of_images_);
  const std::string what =
      text(1, "gyro and images turn about axes ", 180.0 / M_PI * std::acos(std::clamp(cosine, -1.0, 1.0)),
           " degrees apart, by angles of ratio ", ratio);
  if (ratio > kMost) return {step, Verdict::kWarn, what, "is angular_velocity in rad/s, and of this camera's IMU?"};
  // A gyro that turns less than the images is no proof: a mover may fill the view.
  if (cosine < kAgree && ratio * kMost > 1.0)
    return {step, Verdict::kWarn, what, "is the IMU mounted as TF has its frame?"};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
