#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/Imu.h>

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "../../check/unused_input.hpp"
#include "../../common/imu_tracks.hpp"
#include "../../common/text.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The topic `imu`, with measurements rotated into other frames of the robot by TF. For any thread.
class ImuInput {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `transforms` and `unused` must outlive the input.
  ImuInput(ros::NodeHandle& nh, const RobotTransforms& transforms, UnusedInput& unused, Report warn)
      : transforms_(transforms), unused_(unused), warn_(std::move(warn)) {
    constexpr int kQueue = 1000;  // messages, a second of the fastest IMUs
    subscriber_ = nh.subscribe<sensor_msgs::Imu>(
        "imu", kQueue, [this](const sensor_msgs::ImuConstPtr& message) { take(*message); }, ros::VoidConstPtr(),
        ros::TransportHints().tcpNoDelay());
  }

  std::string topic() const { return subscriber_.getTopic(); }

  /// R_from_to of `frame` between two stamps (ns). None, with the `problem`, if measurements or the IMU's transform are
  /// missing.
  std::optional<Eigen::Matrix3d> rotation(const std::string& frame, std::int64_t from, std::int64_t to,
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

  /// False if the newest message has no rates, as of a mere accelerometer.
  bool hasRates() const { return has_rates_; }

  /// Unit vector away from the earth in the axes of `frame`, from the last second. None, with the `problem`, if the
  /// robot moved in that second.
  std::optional<Eigen::Vector3d> up(const std::string& frame, std::string& problem) const {
    const std::optional<Eigen::Vector3d> of_imu = gravity_.up(&problem);
    if (!of_imu) {
      problem = topic() + (has_accelerations_ ? ": " + problem : kNoAccelerations);
      return std::nullopt;
    }
    const std::optional<Eigen::Matrix3d> R_frame_imu = axesIn(frame, problem);
    if (!R_frame_imu) return std::nullopt;
    return *R_frame_imu * *of_imu;
  }

 private:
  static constexpr double kFastest = 100.0;  // rad/s (chosen), beyond the range of gyros of 2000 and 4000 deg/s
  static constexpr const char* kNoRates = " measures no rates (angular_velocity_covariance[0] is -1)";
  static constexpr const char* kNoAccelerations =
      " measures no accelerations (linear_acceleration_covariance[0] is -1)";

  void take(const sensor_msgs::Imu& message) {
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

  std::optional<Eigen::Matrix3d> axesIn(const std::string& frame, std::string& problem) const {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::string imu_frame = frame_;
    lock.unlock();
    const std::optional<Eigen::Isometry3d> T_frame_imu = transforms_.find(frame, imu_frame, problem);
    if (!T_frame_imu) return std::nullopt;
    return T_frame_imu->linear();
  }

  const RobotTransforms& transforms_;
  UnusedInput& unused_;
  const Report warn_;
  std::atomic<bool> has_rates_{true}, has_accelerations_{true};  ///< by the newest message
  GyroTrack gyro_;
  GravityTrack gravity_;
  mutable std::mutex mutex_;
  std::string frame_;  // under the mutex
  ros::Subscriber subscriber_;
};

}  // namespace sdvo
