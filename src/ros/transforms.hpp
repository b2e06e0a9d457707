#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "frames.hpp"

namespace sdvo {

/// The robot's transforms as others publish them on TF. tf2_ros' own listener lets exceptions out of its thread, so
/// that one wild stamp on /tf ends the process; here such a transform is left out. Warns of those that contend with
/// ours.
class RobotTransforms {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `ours`: the transform that this node publishes (odom: parent, base: child); none when it publishes none.
  RobotTransforms(ros::NodeHandle& nh, std::optional<ros_conversions::OdometryFrames> ours, Report warn);

  /// The transform that this node publishes from now on, for a node that learns it late. Only where callbacks run.
  void claim(ros_conversions::OdometryFrames ours) { ours_ = std::move(ours); }

  /// T_parent_child at the newest time known; none, and why, while TF has no such transform.
  std::optional<Eigen::Isometry3d> find(const std::string& parent, const std::string& child,
                                        std::string& problem) const;

  /// Why there is none, and what to publish.
  std::string explainMissing(const std::string& base_frame, const std::string& camera_frame) const;

  /// T_child(from)_child(to), as `fixed` has it: how a frame moved between two times.
  std::optional<Eigen::Isometry3d> findMotion(const std::string& fixed, const std::string& child, const ros::Time& from,
                                              const ros::Time& to, std::string& problem) const;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void receive(const Event& event, bool is_static);
  void watch(const geometry_msgs::TransformStamped& transform, const std::string& publisher);
  std::vector<std::string> ancestors(const std::string& frame) const;
  bool hasAncestor(const std::string& frame, const std::string& ancestor) const;

  std::optional<ros_conversions::OdometryFrames> ours_;
  Report warn_;
  tf2::BufferCore buffer_;
  ros::Time last_update_;
  std::set<std::string> watched_;
  ros::Subscriber dynamic_, static_;
};

/// Where the camera sits on the robot, as TF tells; read once for a camera, until that is forgotten, for the pose goes
/// through it to the odometry's origin. One thread asks, others may read.
class CameraMount {
 public:
  /// `timeout`, s of wall time: how long the first question waits, because static transforms and the first features
  /// arrive together; later ones do not wait.
  CameraMount(const RobotTransforms& transforms, double timeout) : transforms_(transforms), timeout_(timeout) {}

  /// T_base_camera; none, and why, while TF has no such transform. Frame ids without a leading slash.
  std::optional<Eigen::Isometry3d> find(const std::string& base_frame, const std::string& camera_frame,
                                        std::string& problem);

  /// Whether find() has it already.
  bool knows(const std::string& base_frame, const std::string& camera_frame) const;

  /// What TF has by now instead of what find() found, in words; empty while that is the same, and when it was said.
  std::string change();

  /// find() asks TF again.
  void forget() { camera_frame_.clear(); }

  /// What was found last. From any thread.
  std::optional<Eigen::Isometry3d> last() const;

  /// Nobody waits any more. From any thread.
  void stop() { stopping_ = true; }

 private:
  const RobotTransforms& transforms_;
  const double timeout_;
  bool has_waited_ = false;
  std::atomic<bool> stopping_{false};
  std::string base_frame_, camera_frame_;
  bool change_is_told_ = false;
  mutable std::mutex mutex_;
  std::optional<Eigen::Isometry3d> T_base_camera_;
};

/// Publishes on /tf as the node handle has that remapped; tf2_ros' broadcaster has the remappings of the process, which
/// in a manager are those of no nodelet.
class TransformPublisher {
 public:
  explicit TransformPublisher(ros::NodeHandle& nh) : publisher_(nh.advertise<tf2_msgs::TFMessage>("/tf", kQueue)) {}

  void send(const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    publisher_.publish(message);
  }

 private:
  static constexpr int kQueue = 100;  // as tf2_ros' broadcaster

  ros::Publisher publisher_;
};

}  // namespace sdvo
