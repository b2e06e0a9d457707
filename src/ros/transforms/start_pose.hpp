#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>

#include "../../config/interface_options.hpp"
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
            Report warn);

  const Eigen::Isometry3d& T_odom_base() const { return T_odom_base_; }

  /// After a reset of the odometry. Later ones begin at the earlier pose again, not at a `given` one.
  void restart(const std::optional<Eigen::Isometry3d>& given = std::nullopt);

  /// A service has set the present pose.
  void give() { is_given_ = true; }

  /// The base is the camera's optical frame; the axes of odom stay REP-105's.
  void turnToOptical();

  /// Takes the pose from its source. Returns what is missing; empty when done.
  std::string find(const ros::Time& stamp);

  /// T_odom_base by ground_truth_frame_id.
  std::optional<Eigen::Isometry3d> truth(const ros::Time& stamp, std::string& problem) const;

 private:
  std::string takeTruth(const ros::Time& stamp);
  std::string level();

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
