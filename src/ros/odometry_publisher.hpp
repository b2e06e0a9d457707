#pragma once

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>

#include <atomic>
#include <boost/circular_buffer.hpp>
#include <mutex>
#include <vector>

#include "../config/interface_options.hpp"
#include "../messages/odometry_conversions.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"
#include "transforms.hpp"

namespace sdvo {

/// odom, pose, TF, points, map_points, feature_flow and vo_info of one processed pair, and the path, which is long,
/// once in a second.
class OdometryPublisher {
 public:
  /// `tag`: of TransformPublisher.
  OdometryPublisher(ros::NodeHandle& nh, const OdometryOutputOptions& options, std::uint32_t tag);

  /// Publishes what the result's state allows: without a pose neither odom (but for zeros, where these are asked for)
  /// nor TF.
  void publish(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera);
  /// Fills in header, session and latency; returns what was published.
  stereo_descriptor_vo::VoInfo publishInfo(stereo_descriptor_vo::VoInfo info, const ros::Time& stamp);
  void publishFlow(const OdometryResult& result, const StereoFeatures& features, const std_msgs::Header& header);
  void publishPoints(const StereoFeaturesView& features);
  /// Whether somebody listens to map_points.
  bool wantsMap() const { return map_publisher_.getNumSubscribers() > 0; }
  /// `points` in the odometry's origin, the first left camera. They go out in the camera's frame of the header: far
  /// from the origin of odom, as in UTM coordinates, their floats would have steps of half a metre.
  void publishMap(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T_origin_camera,
                  const std_msgs::Header& header);
  /// From now on the odometry's origin is here in odom. The path stays as it was published.
  void moveTo(const Eigen::Isometry3d& T_odom_start) { T_odom_start_ = T_odom_start; }
  /// The odometry has been reset: the path begins anew, too.
  void restart(const Eigen::Isometry3d& T_odom_start);

  static constexpr std::size_t kLongestPath = 20'000;  ///< poses: at 30 Hz eleven minutes, 1.3 MB
  /// The poses since the last reset, the newest `kLongestPath` of them. From any thread.
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
  ros::Publisher odom_publisher_, pose_publisher_, map_publisher_, path_publisher_, info_publisher_, points_publisher_,
      flow_publisher_;
  TransformPublisher transform_publisher_;
  Eigen::Isometry3d T_odom_start_ = Eigen::Isometry3d::Identity();
  mutable std::mutex path_mutex_;
  boost::circular_buffer<PathPose> path_;
  std::atomic<bool> path_changed_{false};  ///< since it was published
  ros::WallTimer path_timer_;
};

}  // namespace sdvo
