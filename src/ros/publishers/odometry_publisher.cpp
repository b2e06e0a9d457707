#include "odometry_publisher.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <boost/make_shared.hpp>
#include <limits>

#include "../../messages/feature_conversions.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"

namespace sdvo {

OdometryPublisher::OdometryPublisher(ros::NodeHandle& nh, const OdometryOutputOptions& options, std::uint32_t tag)
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

void OdometryPublisher::publish(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
                                const std::optional<Eigen::Isometry3d>& T_guess_base) {
  const ros::Time stamp = ros::Time().fromNSec(static_cast<std::uint64_t>(result.stamp));
  if (!result.has_pose) {
    sendCorrection(stamp);
    // By pointer as below: roscpp may swap messages that reach a subscriber of this process by value and by pointer.
    if (options_.publish_null_when_lost && result.state == TrackingState::kLost)
      odom_publisher_.publish(boost::make_shared<nav_msgs::Odometry>(ros_conversions::toNullOdometry(stamp, frames_)));
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
  extendPath(*odometry);
  if (error_publisher_) without_truth_.push_back({stamp, odometry->pose.pose});
}

void OdometryPublisher::publishErrors(const std::function<std::optional<Eigen::Isometry3d>(const ros::Time&)>& truth) {
  while (!without_truth_.empty()) {
    const auto T_odom_base = truth(without_truth_.front().stamp);
    if (!T_odom_base && without_truth_.size() <= kMostWithoutTruth) return;
    if (T_odom_base) {
      Eigen::Isometry3d T_odom_found;
      tf2::fromMsg(without_truth_.front().pose, T_odom_found);
      geometry_msgs::PoseStamped error;
      error.header.stamp = without_truth_.front().stamp;
      error.header.frame_id = frames_.base;
      error.pose = tf2::toMsg(T_odom_base->inverse() * T_odom_found);
      error_publisher_.publish(error);
    }
    without_truth_.pop_front();
  }
}

void OdometryPublisher::sendCorrection(const ros::Time& stamp) {
  if (!options_.correctsGuess() || !T_odom_guess_) return;
  geometry_msgs::TransformStamped correction = tf2::eigenToTransform(*T_odom_guess_);
  correction.header.stamp = stamp;
  correction.header.frame_id = frames_.odom;
  correction.child_frame_id = ros_conversions::cleanFrameId(options_.guess_frame_id);
  transform_publisher_.send(correction);
}

stereo_descriptor_vo::VoInfo OdometryPublisher::publishInfo(stereo_descriptor_vo::VoInfo info, const ros::Time& stamp) {
  info.header.stamp = stamp;
  info.header.frame_id = frames_.odom;
  info.session = session_;
  const ros::Time now = ros::Time::now();  // zero: simulated, and nobody has published it so far
  info.latency =
      now.isZero() ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(secondsBetween(stamp, now));
  info_publisher_.publish(boost::make_shared<stereo_descriptor_vo::VoInfo>(info));
  return info;
}

void OdometryPublisher::publishFlow(const OdometryResult& result, const StereoFeatures& features,
                                    const std_msgs::Header& header) {
  if (flow_publisher_.getNumSubscribers() == 0) return;
  const auto message = boost::make_shared<stereo_descriptor_vo::FeatureFlow>(ros_conversions::toFlow(result, features));
  message->header = header;
  flow_publisher_.publish(message);
}

void OdometryPublisher::publishMap(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T_origin_camera,
                                   const std_msgs::Header& header) {
  const auto cloud =
      boost::make_shared<sensor_msgs::PointCloud2>(ros_conversions::toPointCloud(points, T_origin_camera.inverse()));
  cloud->header = header;
  cloud->header.frame_id = ros_conversions::cleanFrameId(header.frame_id);
  map_publisher_.publish(cloud);
}

void OdometryPublisher::publishPoints(const StereoFeaturesView& features) {
  if (points_publisher_.getNumSubscribers() > 0)
    points_publisher_.publish(boost::make_shared<sensor_msgs::PointCloud2>(ros_conversions::toPointCloud(features)));
}

void OdometryPublisher::restart(const Eigen::Isometry3d& T_odom_start) {
  moveTo(T_odom_start);
  T_odom_guess_.reset();
  without_truth_.clear();
  const std::lock_guard<std::mutex> lock(path_mutex_);
  if (!path_.empty()) path_changed_ = true;
  path_.clear();
}

nav_msgs::Path OdometryPublisher::path() const {
  const std::lock_guard<std::mutex> lock(path_mutex_);
  nav_msgs::Path message;
  message.header.frame_id = frames_.odom;
  if (!path_.empty()) message.header.stamp = path_.back().stamp;
  message.poses.reserve(path_.size());
  geometry_msgs::PoseStamped pose;
  pose.header.frame_id = frames_.odom;
  for (const PathPose& kept : path_) {
    pose.header.stamp = kept.stamp;
    pose.pose = kept.pose;
    message.poses.push_back(pose);
  }
  return message;
}

void OdometryPublisher::extendPath(const nav_msgs::Odometry& odometry) {
  const std::lock_guard<std::mutex> lock(path_mutex_);
  path_.push_back({odometry.header.stamp, odometry.pose.pose});  // in the place of the oldest once it is full
  path_changed_ = true;
}

}  // namespace sdvo
