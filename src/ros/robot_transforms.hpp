#pragma once

#include <ros/node_handle.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "odometry_frames.hpp"

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

  /// T_child(from)_child(to), as `fixed` has it: how a frame moved between two times.
  std::optional<Eigen::Isometry3d> findMotion(const std::string& fixed, const std::string& child, const ros::Time& from,
                                              const ros::Time& to, std::string& problem) const;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void receive(const Event& event, bool is_static);
  void watch(const geometry_msgs::TransformStamped& transform, const std::string& publisher);
  bool hasAncestor(const std::string& frame, const std::string& ancestor) const;

  std::optional<ros_conversions::OdometryFrames> ours_;
  Report warn_;
  tf2::BufferCore buffer_;
  ros::Time last_update_;
  std::set<std::string> watched_;
  ros::Subscriber dynamic_, static_;
};

}  // namespace sdvo
