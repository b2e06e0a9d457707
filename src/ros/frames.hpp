#pragma once

#include <string>

namespace sdvo::ros_conversions {

/// Frame id as tf2 wants it, without a leading slash.
inline std::string cleanFrameId(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

/// Names of the two frames an odometry connects.
struct OdometryFrames {
  std::string odom = "odom";
  std::string base = "base_link";
};

}  // namespace sdvo::ros_conversions
