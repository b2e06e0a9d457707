#include <message_filters/subscriber.h>
#include <message_filters/time_synchronizer.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <std_msgs/Float32.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <stereo_descriptor_vo/messages/stereo_features_view.hpp>

using Features = stereo_descriptor_vo::StereoFeatures;
using Info = stereo_descriptor_vo::VoInfo;

/// Features of a pair with its pose: publishes ~depth, the depth of the nearest feature in m. The three messages of a
/// pair have one stamp. A pair without a pose (LOST) has no odom, so it is left out.
class NearestPoint {
 public:
  NearestPoint() {
    publisher_ = ros::NodeHandle("~").advertise<std_msgs::Float32>("depth", 10);
    pairs_.registerCallback(&NearestPoint::take, this);
  }

 private:
  static constexpr int kQueue = 30;  // pairs: odom follows its features by some milliseconds

  void take(const Features::ConstPtr& features, const nav_msgs::Odometry::ConstPtr& odom,
            const Info::ConstPtr& info) try {
    const sdvo::StereoFeaturesView view(*features);
    std_msgs::Float32 depth;
    depth.data = std::numeric_limits<float>::infinity();
    for (int i = 0; i < view.count(); ++i) depth.data = std::min(depth.data, static_cast<float>(view.point(i).z));
    publisher_.publish(depth);
    const auto& position = odom->pose.pose.position;
    ROS_INFO_THROTTLE(1.0, "%s, epoch %u: at (%.2f, %.2f, %.2f) the nearest of %d features is %.2f m away",
                      info->state.c_str(), info->epoch, position.x, position.y, position.z, view.count(), depth.data);
  } catch (const std::invalid_argument& e) {  // a malformed message
    ROS_ERROR_THROTTLE(5.0, "%s", e.what());
  }

  ros::NodeHandle nh_;
  ros::Publisher publisher_;
  message_filters::Subscriber<Features> features_{nh_, "stereo_features", kQueue};
  message_filters::Subscriber<nav_msgs::Odometry> odometry_{nh_, "odom", kQueue};
  message_filters::Subscriber<Info> info_{nh_, "vo_info", kQueue};
  message_filters::TimeSynchronizer<Features, nav_msgs::Odometry, Info> pairs_{features_, odometry_, info_, kQueue};
};

int main(int argc, char** argv) {
  ros::init(argc, argv, "nearest_point");
  NearestPoint node;
  ros::spin();
}
