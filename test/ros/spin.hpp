#pragma once

#include <ros/ros.h>

#include <functional>

/// What comes from ROS, in the thread of a test.
namespace sdvo {

inline bool spinUntil(const std::function<bool()>& condition) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(10.0);
  while (!condition() && ros::WallTime::now() < end) {
    ros::spinOnce();
    ros::WallDuration(0.001).sleep();
  }
  return condition();
}

}  // namespace sdvo
