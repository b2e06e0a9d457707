#pragma once

#include <string>

namespace sdvo::ros_conversions {

/// Names of the two frames an odometry connects.
struct OdometryFrames {
  std::string odom = "odom";
  std::string base = "base_link";
};

}  // namespace sdvo::ros_conversions
