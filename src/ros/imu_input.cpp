#include "imu_input.hpp"

#include <utility>

#include "frames.hpp"
#include "stamps.hpp"

namespace sdvo {

ImuInput::ImuInput(ros::NodeHandle& nh, const RobotTransforms& transforms, Report warn)
    : transforms_(transforms), warn_(std::move(warn)) {
  constexpr int kQueue = 1000;  // messages, a second of the fastest IMUs
  subscriber_ = nh.subscribe<sensor_msgs::Imu>(
      "imu", kQueue, [this](const sensor_msgs::ImuConstPtr& message) { take(*message); }, ros::VoidConstPtr(),
      ros::TransportHints().tcpNoDelay());
}

void ImuInput::take(const sensor_msgs::Imu& message) {
  const std::string problem = whyUnusable(message.header.stamp);
  if (!problem.empty()) return warn_(topic() + ": a message of the IMU is not used: " + problem);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    frame_ = ros_conversions::cleanFrameId(message.header.frame_id);
  }
  const auto& rate = message.angular_velocity;
  const auto& acceleration = message.linear_acceleration;
  gyro_.add(nanoseconds(message.header.stamp), nanoseconds(ros::Time::now()), {rate.x, rate.y, rate.z});
  gravity_.add(nanoseconds(message.header.stamp), {acceleration.x, acceleration.y, acceleration.z},
               {rate.x, rate.y, rate.z});
}

std::optional<Eigen::Matrix3d> ImuInput::axesIn(const std::string& frame, std::string& problem) const {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::string imu_frame = frame_;
  lock.unlock();
  const std::optional<Eigen::Isometry3d> T_frame_imu = transforms_.find(frame, imu_frame, problem);
  if (!T_frame_imu) return std::nullopt;
  return T_frame_imu->linear();
}

std::optional<Eigen::Matrix3d> ImuInput::rotation(const std::string& frame, const ros::Time& from, const ros::Time& to,
                                                  std::string& problem) const {
  const std::optional<Eigen::Matrix3d> of_imu = gyro_.rotation(nanoseconds(from), nanoseconds(to));
  if (!of_imu) {
    problem = "topic " + topic() + " has no measurements of that time: does it come, and is its clock the cameras'?";
    return std::nullopt;
  }
  const std::optional<Eigen::Matrix3d> R_frame_imu = axesIn(frame, problem);
  if (!R_frame_imu) return std::nullopt;
  return *R_frame_imu * *of_imu * R_frame_imu->transpose();
}

std::optional<Eigen::Vector3d> ImuInput::up(const std::string& frame, std::string& problem) const {
  const std::optional<Eigen::Vector3d> of_imu = gravity_.up();
  if (!of_imu) {
    problem = "the robot moved, or nothing came on " + topic() + ": start while it stands";
    return std::nullopt;
  }
  const std::optional<Eigen::Matrix3d> R_frame_imu = axesIn(frame, problem);
  if (!R_frame_imu) return std::nullopt;
  return *R_frame_imu * *of_imu;
}

}  // namespace sdvo
