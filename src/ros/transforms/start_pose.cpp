#include "start_pose.hpp"

#include <ros/time.h>

#include <utility>

#include "../../common/imu_tracks.hpp"
#include "../../common/text.hpp"
#include "../../messages/pose_conversions.hpp"

namespace sdvo {

StartPose::StartPose(const OdometryOutputOptions& options, const RobotTransforms& transforms, const ImuInput* imu,
                     Place place, Report warn)
    : options_(options),
      transforms_(transforms),
      imu_(imu),
      place_(std::move(place)),
      warn_(std::move(warn)),
      T_odom_base_(ros_conversions::toPose(options.initial_pose)),
      is_level_needed_(imu) {
  restart();
}

void StartPose::restart(const std::optional<Eigen::Isometry3d>& given) {
  is_given_ = given.has_value();
  is_truth_needed_ = !options_.ground_truth_frame_id.empty();
  levels_until_.reset();
  place_(given.value_or(T_odom_base_));
}

void StartPose::turnToOptical() {
  T_odom_base_ = T_odom_base_ * ros_conversions::bodyToOptical();
  if (!is_given_) place_(T_odom_base_);
}

std::string StartPose::find(const ros::Time& stamp) {
  if (is_given_) return "";
  if (is_truth_needed_) return takeTruth(stamp);
  return is_level_needed_ ? level() : "";
}

std::optional<Eigen::Isometry3d> StartPose::truth(const ros::Time& stamp, std::string& problem) const {
  return transforms_.find(options_.ground_truth_frame_id, options_.ground_truth_base_frame_id, problem, stamp);
}

std::string StartPose::takeTruth(const ros::Time& stamp) {
  std::string problem;
  const auto T_odom_base = truth(stamp, problem);
  if (!T_odom_base) return "the first pose is that of ground_truth_frame_id: " + problem;
  is_truth_needed_ = is_level_needed_ = false;
  place_(T_odom_base_ = *T_odom_base);
  return "";
}

/// If the robot stands. That needs a second of measurements, for which it waits 2 s.
std::string StartPose::level() {
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

}  // namespace sdvo
