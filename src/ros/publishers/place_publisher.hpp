#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <tf2_eigen/tf2_eigen.h>

#include <boost/make_shared.hpp>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "../../config/interface_options.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/place_conversions.hpp"
#include "../../places/eased_transform.hpp"
#include "../transforms/transforms.hpp"

namespace sdvo {

/// TF map -> odom, map_pose, place_info, place_signature, and the map: map_path, loops and map_graph.
class PlacePublisher {
 public:
  struct Map {
    ros_conversions::MapState state;
    std::optional<Eigen::Isometry3d> T_base_camera;  ///< none before the first pair
  };
  /// `tag`: of TransformPublisher. `map` returns the current map; a timer calls it.
  PlacePublisher(ros::NodeHandle& nh, const PlaceOutputOptions& options, const std::string& robot, std::uint32_t tag,
                 std::function<Map()> map)
      : options_(options),
        robot_(robot),
        map_frame_(ros_conversions::cleanFrameId(options.map_frame_id)),
        map_(std::move(map)),
        transform_publisher_(nh, tag) {
    constexpr int kQueue = 10;
    info_publisher_ = nh.advertise<stereo_descriptor_vo::PlaceInfo>("place_info", kQueue);
    signature_publisher_ = nh.advertise<stereo_descriptor_vo::PlaceSignature>("place_signature", kQueue);
    match_publisher_ = nh.advertise<stereo_descriptor_vo::PlaceMatch>("other_matches", kQueue);
    pose_publisher_ = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("map_pose", kQueue);
    // Whoever comes late gets the map, too.
    const ros::SubscriberStatusCallback on_connect = [this](const ros::SingleSubscriberPublisher&) { noteChange(); };
    path_publisher_ = nh.advertise<nav_msgs::Path>("map_path", 1, on_connect);
    loops_publisher_ = nh.advertise<visualization_msgs::MarkerArray>("loops", 1, on_connect);
    graph_publisher_ = nh.advertise<stereo_descriptor_vo::MapGraph>("map_graph", 1, on_connect);
    map_timer_ = nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { publishMap(); });
    // In ROS time: TF reports a second transform of one stamp as an error.
    if (options_.publish_tf)
      tf_timer_ = nh.createTimer(ros::Duration(kTfPeriod), [this](const ros::TimerEvent&) { publishTransform(); });
  }

  void publish(const stereo_descriptor_vo::PlaceInfo& info) { info_publisher_.publish(info); }
  void publish(const stereo_descriptor_vo::PlaceSignature& signature) { signature_publisher_.publish(signature); }
  void publish(const stereo_descriptor_vo::PlaceMatch& match) { match_publisher_.publish(match); }
  void publish(const geometry_msgs::PoseWithCovarianceStamped& pose) { pose_publisher_.publish(pose); }

  /// Has the map published soon, if somebody listens.
  void noteChange() {
    const std::lock_guard<std::mutex> lock(mutex_);
    changed_ = true;
  }

  /// Sets T_map_odom. TF moves there smoothly, except the first time and if `at_once`.
  void correct(const Eigen::Isometry3d& T_map_odom, const std::string& odom_frame, bool at_once) {
    constexpr double kSame = 1e-9;
    const std::lock_guard<std::mutex> lock(mutex_);
    const bool is_first = !eased_ || odom_frame != odom_frame_;
    if (!is_first && !at_once && T_map_odom.isApprox(T_map_odom_, kSame)) return;
    odom_frame_ = odom_frame;
    T_map_odom_ = T_map_odom;
    const double now = ros::Time::now().toSec();
    if (is_first || at_once) eased_.emplace(kCorrectionTime);
    eased_->moveTo(T_map_odom, is_first || at_once ? now - kCorrectionTime : now);
  }
  /// T_map_odom is unknown.
  void forget() {
    const std::lock_guard<std::mutex> lock(mutex_);
    eased_.reset();
    changed_ = true;
  }

 private:
  /// Period (s) of map -> odom on /tf. Stamps are two periods ahead, so that listeners need not wait for the next one.
  static constexpr double kTfPeriod = 0.1;
  static constexpr double kCorrectionTime = 2.0;  // s in which a correction goes into map -> odom (chosen)

  void publishTransform() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const ros::Time now = ros::Time::now();
    if (!eased_ || now.isZero() || now == last_stamp_) return;
    last_stamp_ = now;
    geometry_msgs::TransformStamped transform = tf2::eigenToTransform(eased_->at(now.toSec()));
    transform.header.stamp = now + ros::Duration(2.0 * kTfPeriod);
    transform.header.frame_id = map_frame_;
    transform.child_frame_id = odom_frame_;
    transform_publisher_.send(transform);
  }
  /// In a timer, which an exception would end.
  void publishMap() try {
    const bool path_wanted = path_publisher_.getNumSubscribers() > 0;
    const bool loops_wanted = loops_publisher_.getNumSubscribers() > 0;
    const bool graph_wanted = graph_publisher_.getNumSubscribers() > 0;
    if (!path_wanted && !loops_wanted && !graph_wanted) return;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!std::exchange(changed_, false)) return;
    }
    const Map map = map_();
    if (loops_wanted)
      loops_publisher_.publish(
          boost::make_shared<visualization_msgs::MarkerArray>(ros_conversions::toMarkers(map.state, map_frame_)));
    if (graph_wanted)
      graph_publisher_.publish(boost::make_shared<stereo_descriptor_vo::MapGraph>(
          ros_conversions::toMessage(map.state, robot_, map_frame_)));
    // The path is the base's: it has to wait for the first pair.
    if (path_wanted && map.T_base_camera)
      path_publisher_.publish(
          boost::make_shared<nav_msgs::Path>(ros_conversions::toPath(map.state, *map.T_base_camera, map_frame_)));
    else if (path_wanted)
      noteChange();
  } catch (const std::exception& e) {
    ROS_ERROR_STREAM("the map of places is not published: " << e.what());
  }

  const PlaceOutputOptions options_;
  const std::string robot_, map_frame_;
  const std::function<Map()> map_;
  ros::Publisher info_publisher_, signature_publisher_, match_publisher_, pose_publisher_, path_publisher_,
      loops_publisher_, graph_publisher_;
  TransformPublisher transform_publisher_;

  std::mutex mutex_;
  bool changed_ = false;
  std::string odom_frame_;
  Eigen::Isometry3d T_map_odom_;  ///< where eased_ goes
  std::optional<EasedTransform> eased_;
  ros::Time last_stamp_;

  ros::Timer tf_timer_;
  ros::WallTimer map_timer_;
};

}  // namespace sdvo
