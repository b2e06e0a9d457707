#pragma once

#include <ros/init.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "../../common/text.hpp"
#include "transforms.hpp"

namespace sdvo {

/// The camera's pose on the robot, by TF. It is read once for each camera, until forget(): a change would move the
/// odometry's origin. For any thread; await() for one.
class CameraMount {
 public:
  /// `timeout`: s of wall time from the first await() on, after which none waits (chosen: launch files start all nodes
  /// within it).
  explicit CameraMount(const RobotTransforms& transforms, double timeout = 2.0)
      : transforms_(transforms), timeout_(timeout) {}

  /// Waits until TF has the transform, the timeout, or `is_urgent`: static transforms may come after the first
  /// features. Hold no lock meanwhile that others need.
  void await(const std::string& base_frame, const std::string& camera_frame, const std::function<bool()>& is_urgent) {
    if (!deadline_) deadline_ = ros::SteadyTime::now() + ros::WallDuration(timeout_);
    std::string ignored;
    while (!knows(base_frame, camera_frame) && !transforms_.find(base_frame, camera_frame, ignored) &&
           ros::SteadyTime::now() < *deadline_ && !is_urgent() && ros::ok())
      ros::WallDuration(0.01).sleep();
  }

  /// T_base_camera. None, with the `problem`, while TF has no such transform. Frame ids without a leading slash.
  std::optional<Eigen::Isometry3d> find(const std::string& base_frame, const std::string& camera_frame,
                                        std::string& problem) {
    if (knows(base_frame, camera_frame)) return last();
    const std::optional<Eigen::Isometry3d> found = transforms_.find(base_frame, camera_frame, problem);
    if (!found) return std::nullopt;
    const std::lock_guard<std::mutex> lock(mutex_);
    base_frame_ = base_frame;
    camera_frame_ = camera_frame;
    change_reported_ = false;
    return T_base_camera_ = found;
  }

  /// Whether find() returned this transform already.
  bool knows(const std::string& base_frame, const std::string& camera_frame) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return T_base_camera_ && base_frame == base_frame_ && camera_frame == camera_frame_;
  }

  /// How the transform on TF differs by now from find()'s, in words. Empty if it does not, or was reported already.
  std::string change() {
    constexpr double kNear = 0.005, kAlike = 0.5 * M_PI / 180.0;  // m, rad: more than a mast bends (chosen)
    std::string ignored;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (change_reported_ || camera_frame_.empty()) return "";
    const std::optional<Eigen::Isometry3d> now = transforms_.find(base_frame_, camera_frame_, ignored);
    if (!now) return "";
    const Eigen::Isometry3d moved = T_base_camera_->inverse() * *now;
    const double way = moved.translation().norm(), angle = Eigen::AngleAxisd(moved.linear()).angle();
    if (way <= kNear && angle <= kAlike) return "";
    change_reported_ = true;
    return text(3, base_frame_, " -> ", camera_frame_, " has changed by ", way, " m and ", 180.0 / M_PI * angle,
                " deg");
  }

  /// The next find() reads TF again.
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    camera_frame_.clear();
  }

  /// Result of the last find() that succeeded.
  std::optional<Eigen::Isometry3d> last() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return T_base_camera_;
  }

 private:
  const RobotTransforms& transforms_;
  const double timeout_;
  std::optional<ros::SteadyTime> deadline_;
  mutable std::mutex mutex_;  // of what follows
  std::string base_frame_, camera_frame_;
  bool change_reported_ = false;
  std::optional<Eigen::Isometry3d> T_base_camera_;
};

}  // namespace sdvo
