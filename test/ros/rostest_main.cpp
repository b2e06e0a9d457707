#include <gtest/gtest.h>
#include <ros/ros.h>

// The nouns that need a master share one node.
int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "nouns_test");
  ros::NodeHandle keeps_ros_alive;
  return RUN_ALL_TESTS();
}
