#pragma once

#include <ros/ros.h>

#include <functional>

namespace sdvo {

inline bool waitUntil(const std::function<bool()>& condition) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(10.0);
  while (!condition() && ros::WallTime::now() < end) ros::WallDuration(0.001).sleep();
  return condition();
}

/// Meanwhile the thread of the test runs ROS' callbacks.
inline bool spinUntil(const std::function<bool()>& condition) {
  return waitUntil([&] {
    ros::spinOnce();
    return condition();
  });
}

}  // namespace sdvo
