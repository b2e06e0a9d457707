#pragma once

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <tf2_ros/transform_broadcaster.h>

#include <atomic>
#include <boost/circular_buffer.hpp>
#include <mutex>

#include "../config/interface_options.hpp"
#include "conversions.hpp"

namespace sdvo {

/// odom, TF, points, feature_flow and vo_info of one processed pair, and the path, which is long, once in a second.
class OdometryPublisher {
 public:
  OdometryPublisher(ros::NodeHandle& nh, const OdometryOutputOptions& options);

  /// Publishes what the result's state allows: without a pose neither odom nor TF.
  void publish(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera);
  /// Fills in header, session and latency; returns what was published.
  stereo_descriptor_vo::VoInfo publishInfo(stereo_descriptor_vo::VoInfo info, const ros::Time& stamp);
  void publishFlow(const OdometryResult& result, const StereoFeatures& features, const std_msgs::Header& header);
  void publishPoints(const stereo_descriptor_vo::StereoFeatures& features);
  /// The odometry has been reset: the path begins anew, and the base is here in odom.
  void restart(const Eigen::Isometry3d& T_odom_start);

  /// The poses since the last reset, the newest `max_path_length` of them. From any thread.
  nav_msgs::Path path() const;

 private:
  /// A pose of the path, in no more memory than it needs: there are many, in one block.
  struct PathPose {
    ros::Time stamp;
    geometry_msgs::Pose pose;
  };

  static constexpr double kPathPeriod = 1.0;  // s of wall time

  void extendPath(const nav_msgs::Odometry& odometry);

  OdometryOutputOptions options_;
  ros_conversions::OdometryFrames frames_;
  const ros::Time session_;
  ros::Publisher odom_publisher_, path_publisher_, info_publisher_, points_publisher_, flow_publisher_;
  tf2_ros::TransformBroadcaster broadcaster_;
  Eigen::Isometry3d T_odom_start_ = Eigen::Isometry3d::Identity();
  mutable std::mutex path_mutex_;
  boost::circular_buffer<PathPose> path_;
  std::atomic<bool> path_changed_{false};  ///< since it was published
  ros::WallTimer path_timer_;
};

}  // namespace sdvo
