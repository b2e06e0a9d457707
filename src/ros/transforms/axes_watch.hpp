#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "../../check/axes_check.hpp"
#include "../../check/mount_check.hpp"
#include "../../messages/stamps.hpp"
#include "imu_input.hpp"
#include "stereo_descriptor_vo/odometry/motion_guess.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Compares the axes of camera and IMU on TF with the motion in the images, from a start of the odometry on. Warns once
/// of each fault.
class AxesWatch {
 public:
  using Report = std::function<void(const std::string&)>;

  explicit AxesWatch(Report warn) : warn_(std::move(warn)) {}

  /// `T_previous_current`: of the camera since the pair before. `is_base`: the base is the camera itself.
  void add(const Eigen::Isometry3d& T_base_camera, bool is_base, const Eigen::Isometry3d& T_previous_current,
           const PlanarOptions& floor) {
    if (!is_base) optical_axis_.add(T_base_camera, T_previous_current);
    warnOnce("axes", optical_found_, optical_axis_.judge(), "");
    mount_.add(T_base_camera, T_previous_current);
    if (floor.planar && !mount_found_.isFault())
      warnOnce("mount", mount_found_, mount_.judge(floor.planar_tilt_sigma), "");
  }

  /// The same rotation by the gyro and by the images, in the axes of `camera_frame`.
  void addGyro(const ImuInput& imu, const std::string& camera_frame, const ros::Time& from, const ros::Time& to,
               const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images) {
    gyro_.add(nanoseconds(from), nanoseconds(to), by_gyro, by_images);
    const auto rotation = [&](std::int64_t begin, std::int64_t end) {
      std::string ignored;
      return imu.rotation(camera_frame, begin, end, ignored);
    };
    warnOnce("IMU", gyro_found_, gyro_.judge(rotation), " No guess is taken from it until a reset");
  }

  bool trustsGyro() const { return !gyro_found_.isFault(); }

 private:
  void warnOnce(const std::string& step, Finding& last, const Finding& found, const std::string& consequence) {
    if (!std::exchange(last, found).isFault() && found.isFault()) warn_(step + ": " + found.text() + consequence);
  }

  Report warn_;
  OpticalAxisCheck optical_axis_;
  MountCheck mount_;
  GyroAxesCheck gyro_;
  Finding optical_found_{}, mount_found_{}, gyro_found_{};  // as reported last
};

}  // namespace sdvo
