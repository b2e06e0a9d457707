#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>

#include <pluginlib/class_list_macros.hpp>

namespace slow_nodelets {

/// A nodelet of others, whose callback takes a thread of the manager and keeps it until the parameter ~released is set.
/// ~busy tells that it has one.
class SlowNodelet : public nodelet::Nodelet {
  void onInit() override { subscriber_ = getNodeHandle().subscribe("left/image_rect", 1, &SlowNodelet::onImage, this); }

  void onImage(const sensor_msgs::ImageConstPtr&) {
    const ros::NodeHandle& nh = getPrivateNodeHandle();
    nh.setParam("busy", true);
    while (ros::ok() && !nh.hasParam("released")) ros::WallDuration(0.05).sleep();
    nh.setParam("busy", false);
  }

  ros::Subscriber subscriber_;
};

}  // namespace slow_nodelets

PLUGINLIB_EXPORT_CLASS(slow_nodelets::SlowNodelet, nodelet::Nodelet)
