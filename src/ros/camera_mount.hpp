#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "robot_transforms.hpp"

namespace sdvo {

/// Where the camera sits on the robot, as TF tells; read once for a camera, until that is forgotten. One thread asks,
/// others may read.
class CameraMount {
 public:
  /// `timeout`, s of wall time: how long the first question waits, because static transforms and the first features
  /// arrive together; later ones do not wait.
  CameraMount(const RobotTransforms& transforms, double timeout) : transforms_(transforms), timeout_(timeout) {}

  /// T_base_camera; none, and why, while TF has no such transform. Frame ids without a leading slash.
  std::optional<Eigen::Isometry3d> find(const std::string& base_frame, const std::string& camera_frame,
                                        std::string& problem);

  /// Whether find() has it already.
  bool knows(const std::string& base_frame, const std::string& camera_frame) const;

  /// find() asks TF again.
  void forget() { camera_frame_.clear(); }

  /// What was found last. From any thread.
  std::optional<Eigen::Isometry3d> last() const;

  /// Nobody waits any more. From any thread.
  void stop() { stopping_ = true; }

 private:
  const RobotTransforms& transforms_;
  const double timeout_;
  bool has_waited_ = false;
  std::atomic<bool> stopping_{false};
  std::string base_frame_, camera_frame_;
  mutable std::mutex mutex_;
  std::optional<Eigen::Isometry3d> T_base_camera_;
};

}  // namespace sdvo
