#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>

namespace sdvo {

/// Publishes on /tf as the node handle has that remapped; tf2_ros' broadcaster has the remappings of the process, which
/// in a manager are those of no nodelet.
class TransformPublisher {
 public:
  explicit TransformPublisher(ros::NodeHandle& nh) : publisher_(nh.advertise<tf2_msgs::TFMessage>("/tf", kQueue)) {}

  void send(const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    publisher_.publish(message);
  }

 private:
  static constexpr int kQueue = 100;  // as tf2_ros' broadcaster

  ros::Publisher publisher_;
};

}  // namespace sdvo
