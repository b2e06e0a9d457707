#include <message_filters/subscriber.h>
#include <message_filters/time_synchronizer.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <std_msgs/Float32.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <algorithm>
#include <limits>
#include <stereo_descriptor_vo/ros/stereo_features_view.hpp>

using Features = stereo_descriptor_vo::StereoFeatures;
using Info = stereo_descriptor_vo::VoInfo;

/// Features of a pair with its pose: publishes ~depth, the depth of the nearest feature in m. The three messages of a pair have one stamp.
/// A pair without a pose (LOST) has no odom, so it is left out.
int main(int argc, char** argv) {
  ros::init(argc, argv, "nearest_point");
  ros::NodeHandle nh, private_nh("~");
  const ros::Publisher publisher = private_nh.advertise<std_msgs::Float32>("depth", 10);

  constexpr int kQueue = 30;  // pairs: odom follows its features by some milliseconds
  message_filters::Subscriber<Features> features(nh, "stereo_features", kQueue);
  message_filters::Subscriber<nav_msgs::Odometry> odometry(nh, "odom", kQueue);
  message_filters::Subscriber<Info> info(nh, "vo_info", kQueue);
  message_filters::TimeSynchronizer<Features, nav_msgs::Odometry, Info> pairs(features, odometry, info, kQueue);
  pairs.registerCallback(boost::function<void(const Features::ConstPtr&, const nav_msgs::Odometry::ConstPtr&, const Info::ConstPtr&)>(
      [&](const auto& message, const auto& odom, const auto& state) try {
        const sdvo::StereoFeaturesView view(*message);
        std_msgs::Float32 depth;
        depth.data = std::numeric_limits<float>::infinity();
        for (int i = 0; i < view.count(); ++i) depth.data = std::min(depth.data, static_cast<float>(view.point(i).z()));
        publisher.publish(depth);
        const auto& position = odom->pose.pose.position;
        ROS_INFO_THROTTLE(1.0, "%s, epoch %u: at (%.2f, %.2f, %.2f) the nearest of %d features is %.2f m away", state->state.c_str(),
                          state->epoch, position.x, position.y, position.z, view.count(), depth.data);
      } catch (const std::invalid_argument& e) {  // a malformed message
        ROS_ERROR_THROTTLE(5.0, "%s", e.what());
      }));
  ros::spin();
}
