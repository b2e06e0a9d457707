#pragma once

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>

#include <atomic>
#include <boost/circular_buffer.hpp>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "../../config/interface_options.hpp"
#include "../../messages/odometry_conversions.hpp"
#include "../transforms/transforms.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"

namespace sdvo {

/// Publishes odom, pose, TF, ground_truth_error, points, map_points, feature_flow and vo_info of each pair, and once a second the path,
/// which is long.
class OdometryPublisher {
 public:
  /// `tag`: of TransformPublisher.
  OdometryPublisher(ros::NodeHandle& nh, const OdometryOutputOptions& options, std::uint32_t tag);

  /// Without a pose publishes neither odom nor TF; with publish_null_when_lost an odom of zeros. `T_guess_base`: by the
  /// odometry of guess_frame_id, where it is known.
  void publish(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
               const std::optional<Eigen::Isometry3d>& T_guess_base = std::nullopt);
  /// Errors of the last poses, whose truth may come later than they do. `truth`: T_odom_base at a time, where it is
  /// known.
  void publishErrors(const std::function<std::optional<Eigen::Isometry3d>(const ros::Time&)>& truth);
  /// odom -> guess_frame_id as at the last pose, where TF gets it: meanwhile the other odometry carries the base.
  void sendCorrection(const ros::Time& stamp);
  /// Fills in header, session and latency; returns what was published.
  stereo_descriptor_vo::VoInfo publishInfo(stereo_descriptor_vo::VoInfo info, const ros::Time& stamp);
  void publishFlow(const OdometryResult& result, const StereoFeatures& features, const std_msgs::Header& header);
  void publishPoints(const StereoFeaturesView& features);
  /// Whether somebody listens to map_points.
  bool wantsMap() const { return map_publisher_.getNumSubscribers() > 0; }
  /// `points` in the odometry's origin, the first left camera. They are published in the header's camera frame: far
  /// from the origin of odom, such as in UTM coordinates, floats have steps of half a metre.
  void publishMap(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T_origin_camera,
                  const std_msgs::Header& header);
  /// Sets the odometry's origin in odom. Earlier poses of the path stay.
  void moveTo(const Eigen::Isometry3d& T_odom_start) { T_odom_start_ = T_odom_start; }
  /// The same after a reset of the odometry, with an empty path.
  void restart(const Eigen::Isometry3d& T_odom_start);

  static constexpr std::size_t kLongestPath = 20'000;  ///< poses: at 30 Hz eleven minutes, 1.3 MB
  /// The poses since the last reset, the newest `kLongestPath` of them. From any thread.
  nav_msgs::Path path() const;

 private:
  /// A pose of the path without a header, which would take most of the memory.
  struct PathPose {
    ros::Time stamp;
    geometry_msgs::Pose pose;
  };

  static constexpr double kPathPeriod = 1.0;              // s of wall time
  static constexpr std::size_t kMostWithoutTruth = 10;    // poses (chosen)

  void extendPath(const nav_msgs::Odometry& odometry);

  OdometryOutputOptions options_;
  ros_conversions::OdometryFrames frames_;
  const ros::Time session_;
  ros::Publisher odom_publisher_, pose_publisher_, error_publisher_, map_publisher_, path_publisher_, info_publisher_, points_publisher_,
      flow_publisher_;
  TransformPublisher transform_publisher_;
  Eigen::Isometry3d T_odom_start_ = Eigen::Isometry3d::Identity();
  std::optional<Eigen::Isometry3d> T_odom_guess_;  ///< at the last pose
  std::deque<PathPose> without_truth_;             ///< the last poses
  mutable std::mutex path_mutex_;
  boost::circular_buffer<PathPose> path_;
  std::atomic<bool> path_changed_{false};  ///< since it was published
  ros::WallTimer path_timer_;
};

}  // namespace sdvo
