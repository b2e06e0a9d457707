#pragma once

#include <nodelet/loader.h>
#include <ros/ros.h>

#include <string>

namespace sdvo {

/// The main() of a node that is one nodelet: loads it under the node's own name, remappings and arguments and spins.
inline int runNodelet(int argc, char** argv, const std::string& node_name, const std::string& type) {
  ros::init(argc, argv, node_name);
  nodelet::Loader loader(false);
  nodelet::V_string arguments(argv + 1, argv + argc);
  if (!loader.load(ros::this_node::getName(), type, ros::names::getRemappings(), arguments)) return 1;
  ros::spin();
  return 0;
}

}  // namespace sdvo
