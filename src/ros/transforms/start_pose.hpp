#pragma once

#include <ros/time.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "../../common/imu_tracks.hpp"
#include "../../common/text.hpp"
#include "../../config/interface_options.hpp"
#include "../../messages/pose_conversions.hpp"
#include "imu_input.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The base's first pose in odom after a start or a reset: initial_pose, with roll and pitch by the accelerometer
/// (use_imu), or the truth (ground_truth_frame_id), unless a service has set it.
class StartPose {
 public:
  using Place = std::function<void(const Eigen::Isometry3d& T_odom_base)>;
  using Report = std::function<void(const std::string&)>;

  /// `imu`: null without use_imu. `place` is called now and with each change. Throws std::invalid_argument if
  /// initial_pose is none.
  StartPose(const OdometryOutputOptions& options, const RobotTransforms& transforms, const ImuInput* imu, Place place,
            Report warn)
      : options_(options),
        transforms_(transforms),
        imu_(imu),
        place_(std::move(place)),
        warn_(std::move(warn)),
        T_odom_base_(ros_conversions::toPose(options.initial_pose)),
        is_level_needed_(imu) {
    restart();
  }

  const Eigen::Isometry3d& T_odom_base() const { return T_odom_base_; }

  /// After a reset of the odometry. Later ones begin at the earlier pose again, not at a `given` one.
  void restart(const std::optional<Eigen::Isometry3d>& given = std::nullopt) {
    is_given_ = given.has_value();
    is_truth_needed_ = !options_.ground_truth_frame_id.empty();
    levels_until_.reset();
    place_(given.value_or(T_odom_base_));
  }

  /// A service has set the present pose.
  void give() { is_given_ = true; }

  /// The base is the camera's optical frame; the axes of odom stay REP-105's.
  void turnToOptical() {
    T_odom_base_ = T_odom_base_ * ros_conversions::bodyToOptical();
    if (!is_given_) place_(T_odom_base_);
  }

  /// Takes the pose from its source. Returns what is missing; empty when done.
  std::string find(const ros::Time& stamp) {
    if (is_given_) return "";
    if (is_truth_needed_) return takeTruth(stamp);
    return is_level_needed_ ? level() : "";
  }

  /// T_odom_base by ground_truth_frame_id.
  std::optional<Eigen::Isometry3d> truth(const ros::Time& stamp, std::string& problem) const {
    return transforms_.find(options_.ground_truth_frame_id, options_.ground_truth_base_frame_id, problem, stamp);
  }

 private:
  std::string takeTruth(const ros::Time& stamp) {
    std::string problem;
    const auto T_odom_base = truth(stamp, problem);
    if (!T_odom_base) return "the first pose is that of ground_truth_frame_id: " + problem;
    is_truth_needed_ = is_level_needed_ = false;
    place_(T_odom_base_ = *T_odom_base);
    return "";
  }

  /// If the robot stands. That needs a second of measurements, for which it waits 2 s.
  std::string level() {
    constexpr double kTimeout = 2.0;  // s of wall time
    constexpr double kSteep = 0.7;    // cosine of 45 degrees, between robots on slopes and another mounting (chosen)
    const double now = ros::SteadyTime::now().toSec();
    if (!levels_until_) levels_until_ = now + kTimeout;
    std::string problem;
    auto up = imu_->up(options_.base_frame_id, problem);
    if (up && up->dot(T_odom_base_.linear().transpose() * Eigen::Vector3d::UnitZ()) < kSteep) {
      problem = text(2, "by its accelerometer the base is tilted from there, its up is ", up->x(), " ", up->y(), " ",
                     up->z(), ": is the IMU mounted as TF has its frame? Else give this tilt in initial_pose");
      up.reset();
      levels_until_ = now;
    }
    if (!up && now < *levels_until_) return "roll and pitch of the first pose: " + problem;
    is_level_needed_ = false;
    if (up)
      place_(T_odom_base_ = levelled(T_odom_base_, *up));
    else
      warn_("roll and pitch of the first pose are those of initial_pose: " + problem);
    return "";
  }

  const OdometryOutputOptions options_;
  const RobotTransforms& transforms_;
  const ImuInput* const imu_;
  const Place place_;
  const Report warn_;
  Eigen::Isometry3d T_odom_base_;
  bool is_given_ = false, is_truth_needed_ = false;
  bool is_level_needed_;
  std::optional<double> levels_until_;  // s, steady time
};

}  // namespace sdvo
