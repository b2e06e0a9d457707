#pragma once

#include <ros/node_handle.h>
#include <sensor_msgs/Imu.h>

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "../common/imu_tracks.hpp"
#include "diagnostic_tasks.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The topic `imu`, its measurements turned into other frames of the robot by TF. May be used by several threads.
class ImuInput {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `transforms` and `unused` must outlive the input.
  ImuInput(ros::NodeHandle& nh, const RobotTransforms& transforms, UnusedInput& unused, Report warn);

  std::string topic() const { return subscriber_.getTopic(); }

  /// R_from_to of `frame` between two times; none, and why, without measurements of that time or without the IMU on TF.
  std::optional<Eigen::Matrix3d> rotation(const std::string& frame, const ros::Time& from, const ros::Time& to,
                                          std::string& problem) const;

  /// False once messages say that they hold no rates: the topic is an accelerometer's.
  bool hasRates() const { return has_rates_; }

  /// Unit vector away from the earth in the axes of `frame`, as the last second has it; none, and why, unless the robot
  /// stood in that second.
  std::optional<Eigen::Vector3d> up(const std::string& frame, std::string& problem) const;

 private:
  void take(const sensor_msgs::Imu& message);
  std::optional<Eigen::Matrix3d> axesIn(const std::string& frame, std::string& problem) const;

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
