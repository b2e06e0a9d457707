#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/message_traits.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "../common/progress.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace {

// KITTI's times start at 0, which ROS reads as "no time": all stamps are times.txt plus this.
constexpr std::int64_t kEpoch = 1000000000LL * 1000000000LL;  // ns

// Messages travel over a connection per topic, so equal bag times promise no order. The static transforms are written
// this much earlier, for a node that gets them after the first pair could not use that pair.
const ros::Duration kTransformLead(0.1);

const char kOdomFrame[] = "odom";
const char kBaseFrame[] = "base_link";
const char kTrueBaseFrame[] = "base_link_ground_truth";
const char kLeftFrame[] = "stereo_left_optical";
const char kRightFrame[] = "stereo_right_optical";

ros::Time toRosTime(std::int64_t stamp) {
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(kEpoch + stamp));
  return time;
}

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

/// Calibration of an image that is rectified already: no distortion, no rotation, K the left part of P. As in
/// image_pipeline both views are expressed in the left optical frame; the right one's place is in P's Tx =
/// -fx*baseline.
sensor_msgs::CameraInfo makeCameraInfo(const std_msgs::Header& header, const sdvo::StereoCamera& camera, double tx) {
  sensor_msgs::CameraInfo message;
  message.header = header;
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.distortion_model = "plumb_bob";
  message.D.assign(5, 0.0);
  message.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  message.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  message.P = {camera.fx, 0.0, camera.cx, tx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return message;
}

/// A bag that appears under its name only once it is complete; removed when something failed before.
class BagWriter {
 public:
  explicit BagWriter(const std::string& path) : final_(path), partial_(path + ".active") {
    if (fs::is_directory(final_)) throw std::runtime_error("--output '" + path + "' is a directory, not a file name");
    // A device or a pipe would be replaced by the bag.
    if (fs::exists(final_) && !fs::is_regular_file(final_))
      throw std::runtime_error("--output '" + path + "' is no regular file");
    guard("create (does its directory exist, may I write there?)",
          [&] { bag_->open(partial_, rosbag::bagmode::Write); });
  }
  ~BagWriter() {
    if (committed_) return;
    // rosbag closes (writes an index) in its destructor and ends the process when that fails, as it would on a full
    // disk; the process is about to end anyway, so the object is left behind instead.
    bag_.release();
    std::error_code ignored;
    fs::remove(partial_, ignored);
  }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { bag_->write(topic, time, message); });
  }

  /// As write(), but `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = "/kitti_to_bag";
    (*header)["latching"] = "1";
    (*header)["type"] = ros::message_traits::datatype<Message>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
    (*header)["message_definition"] = ros::message_traits::definition<Message>();
    guard("write", [&] { bag_->write(topic, time, message, header); });
  }

  void commit() {
    guard("write", [&] {
      bag_->close();
      fs::rename(partial_, final_);
    });
    committed_ = true;
  }

 private:
  template <class Action>
  void guard(const std::string& what, const Action& action) const {
    try {
      action();
    } catch (const std::exception& e) {
      throw std::runtime_error("--output '" + final_ + "': cannot " + what + ": " + e.what());
    }
  }

  std::string final_, partial_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  bool committed_ = false;
};

void writeTransforms(BagWriter& bag, const ros::Time& start, const sdvo::StereoCamera& camera) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(makeTransform(start, kBaseFrame, kLeftFrame, baseFromOptical()));
  message.transforms.push_back(makeTransform(start, kLeftFrame, kRightFrame,
                                             Eigen::Isometry3d(Eigen::Translation3d(camera.baseline, 0.0, 0.0))));
  bag.writeLatched("/tf_static", start - kTransformLead, message);
}

/// True poses of the base in the odom frame, which is the base's frame at the first stamp.
sdvo::Trajectory basePoses(const sdvo::Trajectory& camera_poses, int frames) {
  const Eigen::Isometry3d T_base_optical = baseFromOptical();
  const Eigen::Isometry3d T_first_world = camera_poses.front().inverse();
  sdvo::Trajectory poses;
  for (int i = 0; i < frames; ++i) {
    poses.push_back(T_base_optical * T_first_world * camera_poses[static_cast<std::size_t>(i)] *
                    T_base_optical.inverse());
  }
  return poses;
}

/// Constant body twist (m/s, rad/s) that leads from one pose to the other: log(inv(from) * to) / dt, linear part first.
Eigen::Matrix<double, 6, 1> bodyTwist(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double dt) {
  const Eigen::Matrix4d log = Eigen::Matrix4d((from.inverse() * to).matrix()).log();
  Eigen::Matrix<double, 6, 1> twist;
  twist << log(0, 3), log(1, 3), log(2, 3), log(2, 1), log(0, 2), log(1, 0);
  return twist / dt;
}

std_msgs::Header makeHeader(const ros::Time& stamp, const char* frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

void writePath(BagWriter& bag, const std::vector<ros::Time>& stamps, const sdvo::Trajectory& poses) {
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
nav_msgs::Odometry makeOdometry(const std::vector<ros::Time>& stamps, const sdvo::Trajectory& poses, std::size_t i) {
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

struct Arguments {
  std::string sequence;
  std::string poses;  ///< empty: look beside the sequence
  int frames = 0;     ///< 0: all
  std::string output;
};

/// True poses of the base for the first `frames` frames; empty, with a note, when there is no ground truth.
sdvo::Trajectory loadGroundTruth(const Arguments& arguments, int frames) {
  const std::optional<std::string> path =
      arguments.poses.empty() ? sdvo::findKittiPoses(arguments.sequence) : arguments.poses;
  if (!path) {
    std::cerr << "note: no poses file beside '" << arguments.sequence
              << "' and no --poses, so the bag has no ground truth" << std::endl;
    return {};
  }
  const sdvo::Trajectory camera_poses = sdvo::readKittiPoses(*path);
  if (static_cast<int>(camera_poses.size()) < frames) {
    throw std::runtime_error("file '" + *path + "' has " + std::to_string(camera_poses.size()) + " poses for " +
                             std::to_string(frames) + " frames: does it belong to this sequence?");
  }
  return basePoses(camera_poses, frames);
}

void convert(const Arguments& arguments) {
  const sdvo::KittiSequence sequence(arguments.sequence);
  if (arguments.frames > sequence.size()) {
    std::cerr << "note: '" << arguments.sequence << "' has only " << sequence.size() << " frames" << std::endl;
  }
  const int frames = arguments.frames > 0 ? std::min(arguments.frames, sequence.size()) : sequence.size();
  const sdvo::Trajectory poses = loadGroundTruth(arguments, frames);
  std::vector<ros::Time> stamps;
  for (int i = 0; i < frames; ++i) stamps.push_back(toRosTime(sequence.stamp(i)));

  BagWriter bag(arguments.output);
  const sdvo::StereoCamera& camera = sequence.camera();
  writeTransforms(bag, stamps.front(), camera);
  if (!poses.empty()) writePath(bag, stamps, poses);
  sdvo::Progress progress("writing bag", frames);
  for (int i = 0; i < frames; ++i) {
    const ros::Time& stamp = stamps[static_cast<std::size_t>(i)];
    const std_msgs::Header header = makeHeader(stamp, kLeftFrame);
    const sdvo::ImagePair pair = sequence.load(i);
    bag.write("/stereo/left/camera_info", stamp, makeCameraInfo(header, camera, 0.0));
    bag.write("/stereo/right/camera_info", stamp, makeCameraInfo(header, camera, -camera.fx * camera.baseline));
    bag.write("/stereo/left/image_rect", stamp, makeImage(header, pair.left));
    bag.write("/stereo/right/image_rect", stamp, makeImage(header, pair.right));
    if (!poses.empty()) {
      bag.write("/ground_truth/odom", stamp, makeOdometry(stamps, poses, static_cast<std::size_t>(i)));
    }
    progress.step();
  }
  bag.commit();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Writes a KITTI sequence as a bag: rectified images and CameraInfo on /stereo/left|right/..., /tf_static and, "
      "where poses are known, /ground_truth/path and /ground_truth/odom. Stamps are times.txt plus 1e9 s.");
  Arguments arguments;
  app.add_option("--sequence", arguments.sequence, "Sequence directory (image_0, image_1, calib.txt, times.txt)")
      ->required();
  app.add_option("--poses", arguments.poses,
                 "Ground truth in KITTI format (default: poses.txt in the sequence or ../../poses/NN.txt)");
  app.add_option("--frames", arguments.frames, "Convert only the first N frames")->check(CLI::Range(1, 1000000));
  app.add_option("--output", arguments.output, "Bag file to write")->required();
  return sdvo::runTool(app, argc, argv, [&] {
    convert(arguments);
    return 0;
  });
}
