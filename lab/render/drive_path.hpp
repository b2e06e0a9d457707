#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace sdvo::render {

/// Where the left camera is at any time. Poses are T_world_camera; the world frame is that of the trajectory (for
/// presets the first camera's): x right, y down, z forward, metres.
class DrivePath {
 public:
  /// A frame is taken at every `steps`-th of the poses, which is `1/rate` seconds; at least one, else
  /// std::invalid_argument.
  DrivePath(std::vector<Eigen::Isometry3d> poses, double rate, int steps = 1);

  /// Number of frames.
  int count() const { return (static_cast<int>(poses_.size()) - 1) / steps_ + 1; }
  double rate() const { return rate_; }
  /// Of a frame.
  const Eigen::Isometry3d& pose(int frame) const { return poses_[static_cast<std::size_t>(frame * steps_)]; }
  /// All poses, those between the frames as well.
  const std::vector<Eigen::Isometry3d>& poses() const { return poses_; }

  /// Between poses, and a little beyond the ends, at constant velocity; `time` in seconds since the first pose.
  Eigen::Isometry3d poseAt(double time) const;
  /// Way covered until `time`, metres in the ground plan.
  double distanceAt(double time) const;

 private:
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<double> distances_;
  double rate_;
  int steps_;
};

}  // namespace sdvo::render
