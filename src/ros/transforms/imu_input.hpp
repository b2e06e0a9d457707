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

#include "../../check/unused_input.hpp"
#include "../../common/imu_tracks.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The topic `imu`, with measurements rotated into other frames of the robot by TF. For any thread.
class ImuInput {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `transforms` and `unused` must outlive the input.
  ImuInput(ros::NodeHandle& nh, const RobotTransforms& transforms, UnusedInput& unused, Report warn);

  std::string topic() const { return subscriber_.getTopic(); }

  /// R_from_to of `frame` between two stamps (ns). None, with the `problem`, if measurements or the IMU's transform are
  /// missing.
  std::optional<Eigen::Matrix3d> rotation(const std::string& frame, std::int64_t from, std::int64_t to,
                                          std::string& problem) const;

  /// False if the newest message has no rates, as of a mere accelerometer.
  bool hasRates() const { return has_rates_; }

  /// Unit vector away from the earth in the axes of `frame`, from the last second. None, with the `problem`, if the
  /// robot moved in that second.
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
