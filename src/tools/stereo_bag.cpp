#include "stereo_bag.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/message_traits.h>
#include <sensor_msgs/Image.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

// Time of the static transforms before the first pair. Each topic has its own connection, so that messages of one time
// arrive in any order, and a node cannot use a pair that comes before the transforms.
const ros::Duration kTransformLead(0.1);

const char kOdomFrame[] = "odom";
const char kBaseFrame[] = "base_link";
const char kTrueBaseFrame[] = "base_link_ground_truth";
const char kLeftFrame[] = "stereo_left_optical";
const char kRightFrame[] = "stereo_right_optical";

/// REP 103: the base looks along x with y to the left and z up, an optical frame along z with x to the right and y
/// down.
Eigen::Isometry3d baseFromOptical() {
  Eigen::Isometry3d T_base_optical = Eigen::Isometry3d::Identity();
  T_base_optical.linear() << 0.0, 0.0, 1.0,  //
      -1.0, 0.0, 0.0,                        //
      0.0, -1.0, 0.0;
  return T_base_optical;
}

geometry_msgs::TransformStamped makeTransform(const ros::Time& stamp, const char* parent, const char* child,
                                              const Eigen::Isometry3d& T_parent_child) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_parent_child);
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  return message;
}

std_msgs::Header makeHeader(const ros::Time& stamp, const char* frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

sensor_msgs::Image makeImage(const std_msgs::Header& header, const cv::Mat& image) {
  sensor_msgs::Image message;
  message.header = header;
  message.width = static_cast<std::uint32_t>(image.cols);
  message.height = static_cast<std::uint32_t>(image.rows);
  message.encoding = "mono8";
  message.step = message.width;
  message.data.assign(image.datastart, image.dataend);  // read or rectified, so continuous
  return message;
}

/// True poses of the base in the odom frame, which is the base's frame at the first stamp.
Trajectory basePoses(const Trajectory& camera_poses) {
  const Eigen::Isometry3d T_base_optical = baseFromOptical();
  if (camera_poses.empty()) return {};
  const Eigen::Isometry3d T_first_world = camera_poses.front().inverse();
  Trajectory poses;
  for (const Eigen::Isometry3d& pose : camera_poses)
    poses.push_back(T_base_optical * T_first_world * pose * T_base_optical.inverse());
  return poses;
}

/// Odometry of frame i. The twist, in the body's axes, is the mean since the previous frame; for the first frame, until
/// the next one.
nav_msgs::Odometry makeOdometry(const std::vector<ros::Time>& stamps, const Trajectory& poses, std::size_t i) {
  nav_msgs::Odometry message;
  message.header = makeHeader(stamps[i], kOdomFrame);
  message.child_frame_id = kTrueBaseFrame;
  message.pose.pose = tf2::toMsg(poses[i]);
  if (poses.size() < 2) return message;
  const std::size_t to = std::max<std::size_t>(i, 1);
  const Vector6d twist = logSE3(poses[to - 1].inverse() * poses[to]) / (stamps[to] - stamps[to - 1]).toSec();
  message.twist.twist = tf2::toMsg(twist);
  return message;
}

std::string newFile(const std::string& path) {
  if (std::filesystem::is_regular_file(path) && !std::filesystem::is_empty(path))
    throw std::runtime_error("--output '" + path + "' exists and stays: give another name, or remove it");
  return std::filesystem::absolute(path).string();
}

}  // namespace

template <class Action>
auto StereoBag::guard(const std::string& what, const Action& action) const try {
  return action();
} catch (const std::exception& e) {
  throw std::runtime_error(name_ + ": cannot " + what + " (is the disk full?): " + e.what());
}

template <class Message>
void StereoBag::write(const std::string& topic, const ros::Time& time, const Message& message) {
  guard("write", [&] { bag_->write(topic, time, message); });
}

template <class Message>
void StereoBag::writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
  const auto header = boost::make_shared<ros::M_string>();
  (*header)["callerid"] = caller_;
  (*header)["latching"] = "1";
  (*header)["type"] = ros::message_traits::datatype<Message>();
  (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
  (*header)["message_definition"] = ros::message_traits::definition<Message>();
  guard("write", [&] { bag_->write(topic, time, message, header); });
}

StereoBag::StereoBag(const std::string& path, const std::string& tool, std::vector<ros::Time> stamps,
                     const StereoCamera& camera, const Trajectory& camera_poses)
    : name_("--output '" + path + "'"),
      caller_("/" + tool),
      file_(newFile(path)),
      bag_(guard("create", [&] { return OutputBag(file_.partial()); })),
      stamps_(std::move(stamps)),
      base_poses_(basePoses(camera_poses)) {
  tf2_msgs::TFMessage transforms;
  const Eigen::Isometry3d T_left_right(Eigen::Translation3d(camera.baseline, 0.0, 0.0));
  transforms.transforms = {makeTransform(stamps_.front(), kBaseFrame, kLeftFrame, baseFromOptical()),
                           makeTransform(stamps_.front(), kLeftFrame, kRightFrame, T_left_right)};
  writeLatched("/tf_static", stamps_.front() - kTransformLead, transforms);
  if (base_poses_.empty()) return;
  nav_msgs::Path path_of_base;
  path_of_base.header = makeHeader(stamps_.front(), kOdomFrame);
  for (std::size_t i = 0; i < base_poses_.size(); ++i) {
    geometry_msgs::PoseStamped pose;
    pose.header = makeHeader(stamps_[i], kOdomFrame);
    pose.pose = tf2::toMsg(base_poses_[i]);
    path_of_base.poses.push_back(pose);
  }
  writeLatched("/ground_truth/path", stamps_.front(), path_of_base);
}

void StereoBag::write(std::size_t i, const std::string& image_topic, const ImagePair& pair,
                      sensor_msgs::CameraInfo left, sensor_msgs::CameraInfo right) {
  const ros::Time& stamp = stamps_[i];
  const std_msgs::Header header = makeHeader(stamp, kLeftFrame);
  left.header = right.header = header;
  write("/stereo/left/camera_info", stamp, left);
  write("/stereo/right/camera_info", stamp, right);
  write("/stereo/left/" + image_topic, stamp, makeImage(header, pair.left));
  write("/stereo/right/" + image_topic, stamp, makeImage(header, pair.right));
  if (!base_poses_.empty()) write("/ground_truth/odom", stamp, makeOdometry(stamps_, base_poses_, i));
}

void StereoBag::commit() {
  guard("write", [&] {
    bag_.close();
    file_.commit();
  });
}

}  // namespace sdvo
