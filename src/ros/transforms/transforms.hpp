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

#include "../../check/finding.hpp"
#include "../../messages/frames.hpp"

namespace sdvo {

/// Frames above a frame on TF, from its parent on.
std::vector<std::string> ancestorsOf(const std::string& frame, const tf2::BufferCore& buffer);

/// Why TF lacks the camera's pose on the robot: the link that is missing, and a command that publishes it.
Finding explainMissing(const std::string& base_frame, const std::string& camera_frame, const tf2::BufferCore& buffer);

/// Listens to TF. An exception in tf2_ros' own listener ends the process, for example of one wild stamp on /tf; here
/// such a transform is left out. Warns of publishers that contradict this node's transform. For any thread.
class RobotTransforms {
 public:
  using Report = std::function<void(const std::string&)>;

  /// `ours`: parent (odom) and child (base) of the transform that this node publishes, if any. `tag`: of its
  /// TransformPublisher.
  RobotTransforms(ros::NodeHandle& nh, std::optional<ros_conversions::OdometryFrames> ours, std::uint32_t tag,
                  Report warn);

  /// Sets `ours` later.
  void setOwnFrames(const ros_conversions::OdometryFrames& ours);

  /// T_parent_child at a time, by default at the newest one known. None, with the `problem`, while TF has no such
  /// transform.
  std::optional<Eigen::Isometry3d> find(const std::string& parent, const std::string& child, std::string& problem,
                                        const ros::Time& time = ros::Time(0)) const;

  /// Why find() returns none.
  std::string explainMissing(const std::string& base_frame, const std::string& camera_frame) const;

  /// T_child(from)_child(to): motion of a frame between two times, by its pose in `fixed`.
  std::optional<Eigen::Isometry3d> findMotion(const std::string& fixed, const std::string& child, const ros::Time& from,
                                              const ros::Time& to, std::string& problem) const;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void receive(const Event& event, bool is_static);
  void watch(const geometry_msgs::TransformStamped& transform, const std::string& publisher);
  std::optional<ros_conversions::OdometryFrames> ours() const;

  mutable std::mutex mutex_;
  std::optional<ros_conversions::OdometryFrames> ours_;  // under the mutex
  const std::uint32_t tag_;
  Report warn_;
  tf2::BufferCore buffer_;
  ros::Time last_update_;
  std::set<std::string> watched_;
  ros::Subscriber dynamic_, static_;
};

/// Publishes on /tf with the nodelet's remappings; tf2_ros' broadcaster has the manager's. All nodelets of a manager
/// have one name on TF, so that transforms carry a tag as `seq`, which nobody else reads, to tell them apart.
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
