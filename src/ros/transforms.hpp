#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "../messages/frames.hpp"

namespace sdvo {

/// The robot's transforms as others publish them on TF. tf2_ros' own listener lets exceptions out of its thread, so
/// that one wild stamp on /tf ends the process; here such a transform is left out. Warns of those that contend with
/// ours.
class RobotTransforms {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `ours`: the transform that this node publishes (odom: parent, base: child); none when it publishes none. `tag`: of
  /// its TransformPublisher.
  RobotTransforms(ros::NodeHandle& nh, std::optional<ros_conversions::OdometryFrames> ours, std::uint32_t tag,
                  Report warn);

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
  const std::uint32_t tag_;
  Report warn_;
  tf2::BufferCore buffer_;
  ros::Time last_update_;
  std::set<std::string> watched_;
  ros::Subscriber dynamic_, static_;
};

/// Where the camera sits on the robot, as TF tells; read once for a camera, until that is forgotten, for the pose goes
/// through it to the odometry's origin. For any thread.
class CameraMount {
 public:
  /// `timeout`, s of wall time: how long await() waits in all.
  CameraMount(const RobotTransforms& transforms, double timeout) : transforms_(transforms), timeout_(timeout) {}

  /// Returns once TF has the transform, after the timeout or when it `is_urgent`: static transforms and the first
  /// features arrive together. Hold no lock meanwhile that others need.
  void await(const std::string& base_frame, const std::string& camera_frame, const std::function<bool()>& is_urgent);

  /// T_base_camera; none, and why, while TF has no such transform. Frame ids without a leading slash.
  std::optional<Eigen::Isometry3d> find(const std::string& base_frame, const std::string& camera_frame,
                                        std::string& problem);

  /// Whether find() has it already.
  bool knows(const std::string& base_frame, const std::string& camera_frame) const;

  /// What TF has by now instead of what find() found, in words; empty while that is the same, and when it was said.
  std::string change();

  /// find() asks TF again.
  void forget();

  /// What was found last.
  std::optional<Eigen::Isometry3d> last() const;

 private:
  const RobotTransforms& transforms_;
  const double timeout_;
  mutable std::mutex mutex_;  // of what follows
  std::optional<ros::SteadyTime> deadline_;
  std::string base_frame_, camera_frame_;
  bool change_is_told_ = false;
  std::optional<Eigen::Isometry3d> T_base_camera_;
};

/// Publishes on /tf as the node handle has that remapped; tf2_ros' broadcaster has the remappings of the process, which
/// in a manager are those of no nodelet. On TF the nodelets of a process have one name: transforms carry a tag as their
/// `seq`, which nobody else reads.
class TransformPublisher {
 public:
  TransformPublisher(ros::NodeHandle& nh, std::uint32_t tag)
      : tag_(tag), publisher_(nh.advertise<tf2_msgs::TFMessage>("/tf", kQueue)) {}

  static std::uint32_t tagOf(const std::string& nodelet) {
    return static_cast<std::uint32_t>(std::hash<std::string>()(nodelet));
  }

  void send(const geometry_msgs::TransformStamped& transform) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    message.transforms.back().header.seq = tag_;
    publisher_.publish(message);
  }

 private:
  static constexpr int kQueue = 100;  // as tf2_ros' broadcaster

  const std::uint32_t tag_;
  ros::Publisher publisher_;
};

}  // namespace sdvo
