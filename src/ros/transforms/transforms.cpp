#include "transforms.hpp"

#include <ros/init.h>
#include <ros/this_node.h>
#include <ros/time.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "../../common/text.hpp"
#include "../../messages/frames.hpp"
#include "../../messages/stamps.hpp"

namespace sdvo {

using ros_conversions::cleanFrameId;

namespace {

constexpr const char* kSetFrame = "set the camera's optical frame in its driver";

bool hasAncestor(const std::string& frame, const std::string& ancestor, const tf2::BufferCore& buffer) {
  const std::vector<std::string> all = ancestorsOf(frame, buffer);
  return std::any_of(all.begin(), all.end(), [&](const auto& each) { return cleanFrameId(each) == ancestor; });
}

/// `base_frame`, or the frame below it whose name begins most like that of `frame`: a part of the same camera.
std::string nearestBelow(const std::string& base_frame, const std::string& frame, const tf2::BufferCore& buffer) {
  constexpr std::ptrdiff_t kLeast = 3;  // letters (chosen)
  std::vector<std::string> all;
  buffer._getFrameStrings(all);
  std::string nearest = base_frame;
  std::ptrdiff_t most = kLeast;
  for (const std::string& each : all) {
    const auto differ = std::mismatch(each.begin(), each.end(), frame.begin(), frame.end());
    const std::ptrdiff_t alike = differ.first - each.begin();
    if (alike <= most || !hasAncestor(each, base_frame, buffer)) continue;
    nearest = each;
    most = alike;
  }
  return nearest;
}

bool isMoving(const std::string& parent, const std::string& child, const tf2::BufferCore& buffer) try {
  return !buffer.lookupTransform(parent, child, ros::Time(0)).header.stamp.isZero();  // zero: static throughout
} catch (const tf2::TransformException&) {
  return false;
}

/// Throws std::invalid_argument for what is no place on a robot, nor on the earth.
Eigen::Isometry3d checked(const geometry_msgs::TransformStamped& transform) {
  constexpr double kFarthest = 1e8;  // m, as of poses
  const Eigen::Isometry3d T = tf2::transformToEigen(transform);
  if (!(T.translation().norm() <= kFarthest) || !T.matrix().allFinite())
    throw std::invalid_argument("TF has '" + transform.child_frame_id + "' beyond 1e8 m of '" +
                                transform.header.frame_id + "': correct its publisher");
  return T;
}

}  // namespace

std::vector<std::string> ancestorsOf(const std::string& frame, const tf2::BufferCore& buffer) {
  constexpr std::size_t kLongestChain = 1000;  // of tf2; frames may stand in a circle
  std::vector<std::string> found;
  std::string parent;
  while (found.size() < kLongestChain && buffer._getParent(found.empty() ? frame : found.back(), ros::Time(0), parent))
    found.push_back(parent);
  return found;
}

Finding explainMissing(const std::string& base_frame, const std::string& camera_frame, const tf2::BufferCore& buffer) {
  if (camera_frame.empty()) return {Verdict::kFail, "the left images have no frame_id", kSetFrame};
  const std::string missing =
      "no transform from camera frame '" + camera_frame + "' to base frame '" + base_frame + "' on TF: ";
  const std::vector<std::string> above = ancestorsOf(camera_frame, buffer);
  const std::string root = cleanFrameId(above.empty() ? camera_frame : above.back());
  if (isMoving(root, camera_frame, buffer)) {  // `root` may be a world's frame, of another odometry
    std::string names;
    for (const std::string& frame : above) names += (names.empty() ? "'" : ", '") + cleanFrameId(frame) + "'";
    return {Verdict::kFail, missing + "it has the camera below " + names,
            "set base_frame_id to the robot's own one of these"};
  }
  const bool has_base = buffer._frameExists(base_frame);
  const std::string last = nearestBelow(base_frame, root, buffer);
  const bool is_optical = above.empty();  // nothing but the images names it
  return {Verdict::kFail,
          missing + "the link " + last + " -> " + root + " is missing (TF has " +
              (has_base ? "" : "no '" + base_frame + "' and ") +
              (is_optical ? "nothing above '" + camera_frame + "'" : "'" + camera_frame + "' below '" + root + "'") +
              ")",
          "let the robot's URDF or the camera's driver publish it. For a camera that looks ahead: rosrun tf2_ros "
          "static_transform_publisher 0 0 0 " +
              std::string(is_optical ? "-0.5 0.5 -0.5 0.5 " : "0 0 0 ") + last + " " + root +
              (has_base ? "" : ". For one in the hand: base_frame_id:=" + root)};
}

RobotTransforms::RobotTransforms(ros::NodeHandle& nh, std::optional<ros_conversions::OdometryFrames> ours,
                                 std::uint32_t tag, Report warn)
    : ours_(std::move(ours)), tag_(tag), warn_(std::move(warn)) {
  constexpr int kQueue = 100;  // as tf2_ros' listener
  const auto subscribe = [&](const std::string& topic, bool is_static) {
    const boost::function<void(const Event&)> receiver = [this, is_static](const Event& event) {
      receive(event, is_static);
    };
    return nh.subscribe<tf2_msgs::TFMessage>(topic, kQueue, receiver);
  };
  dynamic_ = subscribe("/tf", false);
  static_ = subscribe("/tf_static", true);
}

std::optional<Eigen::Isometry3d> RobotTransforms::find(const std::string& parent, const std::string& child,
                                                       std::string& problem, const ros::Time& time) const try {
  return checked(buffer_.lookupTransform(parent, child, time));
} catch (const std::exception& e) {
  problem = e.what();
  return std::nullopt;
}

std::optional<Eigen::Isometry3d> RobotTransforms::findMotion(const std::string& fixed, const std::string& child,
                                                             const ros::Time& from, const ros::Time& to,
                                                             std::string& problem) const try {
  return checked(buffer_.lookupTransform(child, from, child, to, fixed));
} catch (const std::exception& e) {
  problem = e.what();
  return std::nullopt;
}

void RobotTransforms::setOwnFrames(const ros_conversions::OdometryFrames& ours) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ours_ = ours;
}

std::optional<ros_conversions::OdometryFrames> RobotTransforms::ours() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ours_;
}

void RobotTransforms::receive(const Event& event, bool is_static) {
  constexpr double kAhead = 10.0;  // s that tf2 keeps before the newest one: it would refuse all of the present
  const ros::Time now = ros::Time::now();
  if (now < last_update_) buffer_.clear();  // the clock jumped back: static transforms stay
  last_update_ = now;
  const std::string& publisher = event.getPublisherName();
  for (const geometry_msgs::TransformStamped& transform : event.getMessage()->transforms) try {
      const bool is_timeless = transform.header.stamp.isZero();
      if (!is_timeless && !whyUnusable(transform.header.stamp).empty()) continue;
      if (const double ahead = secondsBetween(now, transform.header.stamp);
          !now.isZero() && !is_static && ahead > kAhead)
        throw std::invalid_argument(text(1, "its stamp is ", ahead, " s ahead of this machine's clock"));
      buffer_.setTransform(transform, publisher, is_static);
      watch(transform, publisher);
    } catch (const std::exception& e) {
      warn_("TF: transform " + transform.header.frame_id + " -> " + transform.child_frame_id + " of " + publisher +
            " is left out: " + e.what());
    }
}

void RobotTransforms::watch(const geometry_msgs::TransformStamped& transform, const std::string& publisher) {
  const std::optional<ros_conversions::OdometryFrames> ours = this->ours();
  if (!ours) return;
  const std::string parent = cleanFrameId(transform.header.frame_id);
  const std::string child = cleanFrameId(transform.child_frame_id);
  const std::string& us = ros::this_node::getName();
  if (publisher == us && parent == ours->odom && child == ours->base && transform.header.seq == tag_) return;
  if (!watched_.insert(publisher + " " + parent + " " + child).second) return;
  const std::string who = publisher == us ? "another nodelet of " + us : publisher;
  const std::string contention = "TF: " + who + " publishes " + parent + " -> " + child + ", " + us + " publishes " +
                                 ours->odom + " -> " + ours->base;
  if (child == ours->base && parent == ours->odom)
    warn_(contention + ": frame '" + child + "' jumps between the two; set publish_tf to false in one of them");
  else if (child == ours->base)
    warn_(contention + ": '" + child + "' has a parent already, '" + parent +
          "'. If that is a part of the robot, set " + "base_frame_id:=" + parent +
          " (or invert_tf), else set publish_tf to false in one of them");
  else if ((child == ours->odom || hasAncestor(ours->odom, child, buffer_)) &&
           (parent == ours->base || hasAncestor(parent, ours->base, buffer_)))
    warn_(contention + ": a cycle; nothing can be looked up on TF. Swap frames, or set publish_tf to false here");
}

std::string RobotTransforms::explainMissing(const std::string& base_frame, const std::string& camera_frame) const {
  const std::optional<ros_conversions::OdometryFrames> ours = this->ours();
  if (ours && camera_frame == ours->odom)
    return "the left images' frame_id is '" + camera_frame + "', as odom_frame_id: " + kSetFrame;
  return sdvo::explainMissing(base_frame, camera_frame, buffer_).text();
}

}  // namespace sdvo
