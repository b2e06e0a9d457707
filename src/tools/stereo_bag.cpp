#include "stereo_bag.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <unsupported/Eigen/MatrixFunctions>
#include <utility>

namespace sdvo {
namespace {

// Messages travel over a connection per topic, so equal bag times promise no order. The static transforms are written
// this much earlier, for a node that gets them after the first pair could not use that pair.
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

geometry_msgs::Quaternion toMessage(const Eigen::Quaterniond& q) {
  geometry_msgs::Quaternion message;
  message.x = q.x();
  message.y = q.y();
  message.z = q.z();
  message.w = q.w();
  return message;
}

geometry_msgs::Pose toMessage(const Eigen::Isometry3d& pose) {
  geometry_msgs::Pose message;
  message.position.x = pose.translation().x();
  message.position.y = pose.translation().y();
  message.position.z = pose.translation().z();
  Eigen::Quaterniond rotation = Eigen::Quaterniond(pose.linear()).normalized();
  if (rotation.w() < 0.0) rotation.coeffs() = -rotation.coeffs();  // both signs are the same rotation: keep to one
  message.orientation = toMessage(rotation);
  return message;
}

geometry_msgs::TransformStamped makeTransform(const ros::Time& stamp, const char* parent, const char* child,
                                              const Eigen::Isometry3d& T_parent_child) {
  const geometry_msgs::Pose pose = toMessage(T_parent_child);
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform.translation.x = pose.position.x;
  message.transform.translation.y = pose.position.y;
  message.transform.translation.z = pose.position.z;
  message.transform.rotation = pose.orientation;
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
  message.data.reserve(image.total());
  for (int row = 0; row < image.rows; ++row) {
    message.data.insert(message.data.end(), image.ptr<std::uint8_t>(row), image.ptr<std::uint8_t>(row) + image.cols);
  }
  return message;
}

void writeTransforms(BagWriter& bag, const ros::Time& start, const StereoCamera& camera) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(makeTransform(start, kBaseFrame, kLeftFrame, baseFromOptical()));
  message.transforms.push_back(makeTransform(start, kLeftFrame, kRightFrame,
                                             Eigen::Isometry3d(Eigen::Translation3d(camera.baseline, 0.0, 0.0))));
  bag.writeLatched("/tf_static", start - kTransformLead, message);
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

/// Constant body twist (m/s, rad/s) that leads from one pose to the other: log(inv(from) * to) / dt, linear part first.
Eigen::Matrix<double, 6, 1> bodyTwist(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double dt) {
  const Eigen::Matrix4d log = Eigen::Matrix4d((from.inverse() * to).matrix()).log();
  Eigen::Matrix<double, 6, 1> twist;
  twist << log(0, 3), log(1, 3), log(2, 3), log(2, 1), log(0, 2), log(1, 0);
  return twist / dt;
}

void writePath(BagWriter& bag, const std::vector<ros::Time>& stamps, const Trajectory& poses) {
  nav_msgs::Path path;
  path.header = makeHeader(stamps.front(), kOdomFrame);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    geometry_msgs::PoseStamped pose;
    pose.header = makeHeader(stamps[i], kOdomFrame);
    pose.pose = toMessage(poses[i]);
    path.poses.push_back(pose);
  }
  bag.writeLatched("/ground_truth/path", stamps.front(), path);
}

/// Odometry of frame i. The twist is that of the step that led here; at the first frame that of the step to come.
nav_msgs::Odometry makeOdometry(const std::vector<ros::Time>& stamps, const Trajectory& poses, std::size_t i) {
  nav_msgs::Odometry message;
  message.header = makeHeader(stamps[i], kOdomFrame);
  message.child_frame_id = kTrueBaseFrame;
  message.pose.pose = toMessage(poses[i]);
  if (poses.size() < 2) return message;
  const std::size_t to = std::max<std::size_t>(i, 1);
  const Eigen::Matrix<double, 6, 1> twist = bodyTwist(poses[to - 1], poses[to], (stamps[to] - stamps[to - 1]).toSec());
  message.twist.twist.linear.x = twist[0];
  message.twist.twist.linear.y = twist[1];
  message.twist.twist.linear.z = twist[2];
  message.twist.twist.angular.x = twist[3];
  message.twist.twist.angular.y = twist[4];
  message.twist.twist.angular.z = twist[5];
  return message;
}

}  // namespace

StereoBag::StereoBag(const std::string& path, const std::string& tool, std::vector<ros::Time> stamps,
                     const StereoCamera& camera, const Trajectory& camera_poses)
    : bag_(path, tool), stamps_(std::move(stamps)), base_poses_(basePoses(camera_poses)) {
  writeTransforms(bag_, stamps_.front(), camera);
  if (!base_poses_.empty()) writePath(bag_, stamps_, base_poses_);
}

void StereoBag::write(std::size_t i, const std::string& image_topic, const ImagePair& pair,
                      sensor_msgs::CameraInfo left, sensor_msgs::CameraInfo right) {
  const ros::Time& stamp = stamps_[i];
  const std_msgs::Header header = makeHeader(stamp, kLeftFrame);
  left.header = right.header = header;
  bag_.write("/stereo/left/camera_info", stamp, left);
  bag_.write("/stereo/right/camera_info", stamp, right);
  bag_.write("/stereo/left/" + image_topic, stamp, makeImage(header, pair.left));
  bag_.write("/stereo/right/" + image_topic, stamp, makeImage(header, pair.right));
  if (!base_poses_.empty()) bag_.write("/ground_truth/odom", stamp, makeOdometry(stamps_, base_poses_, i));
}

}  // namespace sdvo
