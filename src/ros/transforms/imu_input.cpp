#include "imu_input.hpp"

#include <utility>

#include "../../common/text.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"

namespace sdvo {
namespace {

constexpr double kFastest = 100.0;  // rad/s (chosen), beyond the range of gyros of 2000 and 4000 deg/s

const std::string kNoRates = " measures no rates (angular_velocity_covariance[0] is -1)";
const std::string kNoAccelerations = " measures no accelerations (linear_acceleration_covariance[0] is -1)";

}  // namespace

ImuInput::ImuInput(ros::NodeHandle& nh, const RobotTransforms& transforms, UnusedInput& unused, Report warn)
    : transforms_(transforms), unused_(unused), warn_(std::move(warn)) {
  constexpr int kQueue = 1000;  // messages, a second of the fastest IMUs
  subscriber_ = nh.subscribe<sensor_msgs::Imu>(
      "imu", kQueue, [this](const sensor_msgs::ImuConstPtr& message) { take(*message); }, ros::VoidConstPtr(),
      ros::TransportHints().tcpNoDelay());
}

void ImuInput::take(const sensor_msgs::Imu& message) {
  constexpr double kNotThere = -1.0;  // sensor_msgs/Imu: first element of the covariance of what is not measured
  const auto& rate = message.angular_velocity;
  const auto& acceleration = message.linear_acceleration;
  const bool has_rates = message.angular_velocity_covariance[0] != kNotThere;
  std::string problem = whyUnusable(message.header.stamp);
  if (problem.empty() && has_rates && !(Eigen::Vector3d(rate.x, rate.y, rate.z).norm() <= kFastest))
    problem = text(0, "its rate is no number, or beyond ", kFastest, " rad/s");
  if (!problem.empty()) {
    unused_.add(UnusedInput::kImu);
    return warn_(topic() + ": a message of the IMU is not used: " + problem);
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    frame_ = ros_conversions::cleanFrameId(message.header.frame_id);
  }
  const std::int64_t stamp = nanoseconds(message.header.stamp);
  has_accelerations_ = message.linear_acceleration_covariance[0] != kNotThere;
  if (has_rates_.exchange(has_rates) && !has_rates) warn_(topic() + kNoRates + ": no guess of the rotation");
  if (has_rates) gyro_.add(stamp, nanoseconds(ros::Time::now()), {rate.x, rate.y, rate.z});
  if (has_accelerations_)
    gravity_.add(stamp, {acceleration.x, acceleration.y, acceleration.z}, {rate.x, rate.y, rate.z});
}

std::optional<Eigen::Matrix3d> ImuInput::axesIn(const std::string& frame, std::string& problem) const {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::string imu_frame = frame_;
  lock.unlock();
  const std::optional<Eigen::Isometry3d> T_frame_imu = transforms_.find(frame, imu_frame, problem);
  if (!T_frame_imu) return std::nullopt;
  return T_frame_imu->linear();
}

std::optional<Eigen::Matrix3d> ImuInput::rotation(const std::string& frame, std::int64_t from, std::int64_t to,
                                                  std::string& problem) const {
  const std::optional<Eigen::Matrix3d> of_imu = gyro_.rotation(from, to, &problem);
  if (!of_imu) {
    problem = topic() + (has_rates_ ? ": " + problem : kNoRates);
    return std::nullopt;
  }
  const std::optional<Eigen::Matrix3d> R_frame_imu = axesIn(frame, problem);
  if (!R_frame_imu) return std::nullopt;
  return *R_frame_imu * *of_imu * R_frame_imu->transpose();
}

std::optional<Eigen::Vector3d> ImuInput::up(const std::string& frame, std::string& problem) const {
  const std::optional<Eigen::Vector3d> of_imu = gravity_.up(&problem);
  if (!of_imu) {
    problem = topic() + (has_accelerations_ ? ": " + problem : kNoAccelerations);
    return std::nullopt;
  }
  const std::optional<Eigen::Matrix3d> R_frame_imu = axesIn(frame, problem);
  if (!R_frame_imu) return std::nullopt;
  return *R_frame_imu * *of_imu;
}

}  // namespace sdvo
