#pragma once

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <tf2_eigen/tf2_eigen.h>

#include <atomic>
#include <boost/circular_buffer.hpp>
#include <boost/make_shared.hpp>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "../../config/interface_options.hpp"
#include "../../messages/feature_conversions.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/odometry_conversions.hpp"
#include "../../messages/stamps.hpp"
#include "../transforms/transforms.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"

namespace sdvo {

/// Publishes odom, pose, TF, ground_truth_error, points, map_points, feature_flow and vo_info of each pair, and once a
/// second the path, which is long.
class OdometryPublisher {
 public:
  /// `tag`: of TransformPublisher.
  OdometryPublisher(ros::NodeHandle& nh, const OdometryOutputOptions& options, std::uint32_t tag)
      : options_(options),
        frames_{ros_conversions::cleanFrameId(options.odom_frame_id),
                ros_conversions::cleanFrameId(options.base_frame_id)},
        session_(ros::Time().fromNSec(ros::WallTime::now().toNSec())),
        transform_publisher_(nh, tag),
        path_(kLongestPath) {
    constexpr int kQueue = 10;
    odom_publisher_ = nh.advertise<nav_msgs::Odometry>("odom", kQueue);
    pose_publisher_ = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kQueue);
    if (!options_.ground_truth_frame_id.empty())
      error_publisher_ = nh.advertise<geometry_msgs::PoseStamped>("ground_truth_error", kQueue);
    map_publisher_ = nh.advertise<sensor_msgs::PointCloud2>("map_points", 1);
    // Whoever comes late gets the path, too.
    path_publisher_ = nh.advertise<nav_msgs::Path>("path", 1, [this](const ros::SingleSubscriberPublisher&) {
      const std::lock_guard<std::mutex> lock(path_mutex_);
      if (!path_.empty()) path_changed_ = true;
    });
    info_publisher_ = nh.advertise<stereo_descriptor_vo::VoInfo>("vo_info", kQueue);
    points_publisher_ = nh.advertise<sensor_msgs::PointCloud2>("points", 1);
    flow_publisher_ = nh.advertise<stereo_descriptor_vo::FeatureFlow>("feature_flow", kQueue);
    path_timer_ = nh.createWallTimer(ros::WallDuration(kPathPeriod), [this](const ros::WallTimerEvent&) {
      if (path_publisher_.getNumSubscribers() > 0 && path_changed_.exchange(false))
        path_publisher_.publish(boost::make_shared<nav_msgs::Path>(path()));
    });
  }

  /// Without a pose publishes neither odom nor TF; with publish_null_when_lost an odom of zeros. `T_guess_base`: by the
  /// odometry of guess_frame_id, where it is known.
  void publish(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
               const std::optional<Eigen::Isometry3d>& T_guess_base = std::nullopt) {
    const ros::Time stamp = ros::Time().fromNSec(static_cast<std::uint64_t>(result.stamp));
    if (!result.has_pose) {
      sendCorrection(stamp);
      // By pointer as below: roscpp may swap messages that reach a subscriber of this process by value and by pointer.
      if (options_.publish_null_when_lost && result.state == TrackingState::kLost)
        odom_publisher_.publish(
            boost::make_shared<nav_msgs::Odometry>(ros_conversions::toNullOdometry(stamp, frames_)));
      return;
    }
    const auto odometry = boost::make_shared<nav_msgs::Odometry>(
        ros_conversions::toOdometry(result, T_base_camera, frames_, T_odom_start_));
    // TF first: whoever acts on the odometry finds the transform there.
    Eigen::Isometry3d T_odom_base;
    tf2::fromMsg(odometry->pose.pose, T_odom_base);
    if (T_guess_base) T_odom_guess_ = T_odom_base * T_guess_base->inverse();
    sendCorrection(stamp);
    if (options_.publish_tf && !options_.correctsGuess())
      transform_publisher_.send(ros_conversions::toTransform(*odometry, options_.invert_tf));
    odom_publisher_.publish(odometry);
    const auto pose = boost::make_shared<geometry_msgs::PoseWithCovarianceStamped>();
    pose->header = odometry->header;
    pose->pose = odometry->pose;
    pose_publisher_.publish(pose);
    geometry_msgs::PoseStamped kept;
    kept.header = odometry->header;
    kept.pose = odometry->pose.pose;
    if (error_publisher_) without_truth_.push_back(kept);
    const std::lock_guard<std::mutex> lock(path_mutex_);
    path_.push_back(kept);  // in the place of the oldest once it is full
    path_changed_ = true;
  }
  /// Errors of the last poses, whose truth may come later than they do. `truth`: T_odom_base at a time, where it is
  /// known.
  void publishErrors(const std::function<std::optional<Eigen::Isometry3d>(const ros::Time&)>& truth) {
    while (!without_truth_.empty()) {
      const auto T_odom_base = truth(without_truth_.front().header.stamp);
      if (!T_odom_base && without_truth_.size() <= kMostWithoutTruth) return;
      if (T_odom_base) {
        Eigen::Isometry3d T_odom_found;
        tf2::fromMsg(without_truth_.front().pose, T_odom_found);
        geometry_msgs::PoseStamped error;
        error.header.stamp = without_truth_.front().header.stamp;
        error.header.frame_id = frames_.base;
        error.pose = tf2::toMsg(T_odom_base->inverse() * T_odom_found);
        error_publisher_.publish(error);
      }
      without_truth_.pop_front();
    }
  }
  /// odom -> guess_frame_id as at the last pose, where TF gets it: meanwhile the other odometry carries the base.
  void sendCorrection(const ros::Time& stamp) {
    if (!options_.correctsGuess() || !T_odom_guess_) return;
    geometry_msgs::TransformStamped correction = tf2::eigenToTransform(*T_odom_guess_);
    correction.header.stamp = stamp;
    correction.header.frame_id = frames_.odom;
    correction.child_frame_id = ros_conversions::cleanFrameId(options_.guess_frame_id);
    transform_publisher_.send(correction);
  }
  /// Fills in header, session and latency; returns what was published.
  stereo_descriptor_vo::VoInfo publishInfo(stereo_descriptor_vo::VoInfo info, const ros::Time& stamp) {
    info.header.stamp = stamp;
    info.header.frame_id = frames_.odom;
    info.session = session_;
    const ros::Time now = ros::Time::now();  // zero: simulated, and nobody has published it so far
    info.latency =
        now.isZero() ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(secondsBetween(stamp, now));
    info_publisher_.publish(boost::make_shared<stereo_descriptor_vo::VoInfo>(info));
    return info;
  }
  void publishFlow(const OdometryResult& result, const StereoFeatures& features, const std_msgs::Header& header) {
    if (flow_publisher_.getNumSubscribers() == 0) return;
    const auto message =
        boost::make_shared<stereo_descriptor_vo::FeatureFlow>(ros_conversions::toFlow(result, features));
    message->header = header;
    flow_publisher_.publish(message);
  }
  void publishPoints(const StereoFeaturesView& features) {
    if (points_publisher_.getNumSubscribers() > 0)
      points_publisher_.publish(boost::make_shared<sensor_msgs::PointCloud2>(ros_conversions::toPointCloud(features)));
  }
  /// Whether somebody listens to map_points.
  bool wantsMap() const { return map_publisher_.getNumSubscribers() > 0; }
  /// `points` in the odometry's origin, the first left camera. They are published in the header's camera frame: far
  /// from the origin of odom, such as in UTM coordinates, floats have steps of half a metre.
  void publishMap(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T_origin_camera,
                  const std_msgs::Header& header) {
    const auto cloud =
        boost::make_shared<sensor_msgs::PointCloud2>(ros_conversions::toPointCloud(points, T_origin_camera.inverse()));
    cloud->header = header;
    cloud->header.frame_id = ros_conversions::cleanFrameId(header.frame_id);
    map_publisher_.publish(cloud);
  }
  /// Sets the odometry's origin in odom. Earlier poses of the path stay.
  void moveTo(const Eigen::Isometry3d& T_odom_start) { T_odom_start_ = T_odom_start; }
  /// The same after a reset of the odometry, with an empty path.
  void restart(const Eigen::Isometry3d& T_odom_start) {
    moveTo(T_odom_start);
    T_odom_guess_.reset();
    without_truth_.clear();
    const std::lock_guard<std::mutex> lock(path_mutex_);
    if (!path_.empty()) path_changed_ = true;
    path_.clear();
  }

  static constexpr std::size_t kLongestPath = 20'000;  ///< poses: at 30 Hz eleven minutes, 2 MB
  /// The poses since the last reset, the newest `kLongestPath` of them. From any thread.
  nav_msgs::Path path() const {
    const std::lock_guard<std::mutex> lock(path_mutex_);
    nav_msgs::Path message;
    message.header.frame_id = frames_.odom;
    if (!path_.empty()) message.header.stamp = path_.back().header.stamp;
    message.poses.assign(path_.begin(), path_.end());
    return message;
  }

 private:
  static constexpr double kPathPeriod = 1.0;            // s of wall time
  static constexpr std::size_t kMostWithoutTruth = 10;  // poses (chosen)

  OdometryOutputOptions options_;
  ros_conversions::OdometryFrames frames_;
  const ros::Time session_;
  ros::Publisher odom_publisher_, pose_publisher_, error_publisher_, map_publisher_, path_publisher_, info_publisher_,
      points_publisher_, flow_publisher_;
  TransformPublisher transform_publisher_;
  Eigen::Isometry3d T_odom_start_ = Eigen::Isometry3d::Identity();
  std::optional<Eigen::Isometry3d> T_odom_guess_;         ///< at the last pose
  std::deque<geometry_msgs::PoseStamped> without_truth_;  ///< the last poses
  mutable std::mutex path_mutex_;
  boost::circular_buffer<geometry_msgs::PoseStamped> path_;
  std::atomic<bool> path_changed_{false};  ///< since it was published
  ros::WallTimer path_timer_;
};

}  // namespace sdvo
