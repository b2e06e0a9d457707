#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

namespace sdvo::render {

/// Where the left camera is at any time. Poses are T_world_camera; the world frame is that of the trajectory (for
/// presets the first camera's): x right, y down, z forward, metres.
class DrivePath {
 public:
  /// `poses` are `1/rate` seconds apart; at least one, else std::invalid_argument.
  DrivePath(std::vector<Eigen::Isometry3d> poses, double rate);

  int count() const { return static_cast<int>(poses_.size()); }
  double rate() const { return rate_; }
  const Eigen::Isometry3d& pose(int index) const { return poses_[static_cast<std::size_t>(index)]; }
  const std::vector<Eigen::Isometry3d>& poses() const { return poses_; }

  /// Between poses, and a little beyond the ends, at constant velocity; `time` in seconds since the first pose.
  Eigen::Isometry3d poseAt(double time) const;
  /// Way covered until `time`, metres in the ground plan.
  double distanceAt(double time) const;

 private:
  std::vector<Eigen::Isometry3d> poses_;
  std::vector<double> distances_;
  double rate_;
};

/// The names makePresetPath() knows.
const std::vector<std::string>& presetNames();

/// A preset at `rate` Hz: straight (10 m/s), figure_eight (two circles of 28 m radius), city_loop (1.1 km with three
/// stops), back_and_forth (20 m, five times), hover (a drone in a room), hover_1m (the same, all of its way shrunk into
/// 1 m^3) or still. `frames` = 0 asks for the preset's natural length. Drives shake a little as cars do. Throws
/// std::invalid_argument for another name.
DrivePath makePresetPath(const std::string& name, int frames, double rate, std::uint64_t seed);

}  // namespace sdvo::render
