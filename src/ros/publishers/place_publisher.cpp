#include "place_publisher.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <boost/make_shared.hpp>
#include <utility>

#include "../../messages/frames.hpp"

namespace sdvo {

namespace msgs = stereo_descriptor_vo;

namespace {

/// Period (s) of map -> odom on /tf. Stamps are two periods ahead, so that listeners need not wait for the next one.
constexpr double kTfPeriod = 0.1;

}  // namespace

PlacePublisher::PlacePublisher(ros::NodeHandle& nh, const PlaceOutputOptions& options, const std::string& robot,
                               std::uint32_t tag, std::function<Map()> map)
    : options_(options),
      robot_(robot),
      map_frame_(ros_conversions::cleanFrameId(options.map_frame_id)),
      map_(std::move(map)),
      transform_publisher_(nh, tag) {
  constexpr int kQueue = 10;
  info_publisher_ = nh.advertise<msgs::PlaceInfo>("place_info", kQueue);
  signature_publisher_ = nh.advertise<msgs::PlaceSignature>("place_signature", kQueue);
  match_publisher_ = nh.advertise<msgs::PlaceMatch>("other_matches", kQueue);
  pose_publisher_ = nh.advertise<geometry_msgs::PoseWithCovarianceStamped>("map_pose", kQueue);
  // Whoever comes late gets the map, too.
  const ros::SubscriberStatusCallback on_connect = [this](const ros::SingleSubscriberPublisher&) { noteChange(); };
  path_publisher_ = nh.advertise<nav_msgs::Path>("map_path", 1, on_connect);
  loops_publisher_ = nh.advertise<visualization_msgs::MarkerArray>("loops", 1, on_connect);
  graph_publisher_ = nh.advertise<msgs::MapGraph>("map_graph", 1, on_connect);
  map_timer_ = nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { publishMap(); });
  // In ROS time: TF reports a second transform of one stamp as an error.
  if (options_.publish_tf)
    tf_timer_ = nh.createTimer(ros::Duration(kTfPeriod), [this](const ros::TimerEvent&) { publishTransform(); });
}

void PlacePublisher::noteChange() {
  const std::lock_guard<std::mutex> lock(mutex_);
  changed_ = true;
}

void PlacePublisher::correct(const Eigen::Isometry3d& T_map_odom, const std::string& odom_frame, bool at_once) {
  constexpr double kSame = 1e-9;
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_first = !eased_ || odom_frame != odom_frame_;
  if (!is_first && !at_once && T_map_odom.isApprox(T_map_odom_, kSame)) return;
  odom_frame_ = odom_frame;
  T_map_odom_ = T_map_odom;
  const double now = ros::Time::now().toSec();
  if (is_first || at_once) eased_.emplace(options_.correction_time);
  eased_->moveTo(T_map_odom, is_first || at_once ? now - options_.correction_time : now);
}

void PlacePublisher::forget() {
  const std::lock_guard<std::mutex> lock(mutex_);
  eased_.reset();
  changed_ = true;
}

void PlacePublisher::publishTransform() {
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
void PlacePublisher::publishMap() try {
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
    graph_publisher_.publish(
        boost::make_shared<msgs::MapGraph>(ros_conversions::toMessage(map.state, robot_, map_frame_)));
  // The path is the base's: it has to wait for the first pair.
  if (path_wanted && map.T_base_camera)
    path_publisher_.publish(
        boost::make_shared<nav_msgs::Path>(ros_conversions::toPath(map.state, *map.T_base_camera, map_frame_)));
  else if (path_wanted)
    noteChange();
} catch (const std::exception& e) {
  ROS_ERROR_STREAM("the map of places is not published: " << e.what());
}

}  // namespace sdvo
