// Converts recorded drives: a folder (KITTI, EuRoC) to a bag, or any recording to a folder in KITTI's layout.
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/message_traits.h>
#include <ros/time.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/fill_image.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "../common/progress.hpp"
#include "../common/text.hpp"
#include "../data/euroc_dataset.hpp"
#include "../ros/files/output_files.hpp"
#include "pair_reader.hpp"
#include "recording.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace {

using namespace sdvo;

// KITTI's times start at 0, which ROS reads as "no time": all stamps are times.txt plus this.
constexpr std::int64_t kEpoch = 1000000000LL * 1000000000LL;  // ns

// s from the static transforms to the first pair. Topics of equal stamps reach a node in any order, and a pair that
// comes before the transforms is of no use.
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

std_msgs::Header makeHeader(const ros::Time& stamp, const char* frame) {
  std_msgs::Header header;
  header.stamp = stamp;
  header.frame_id = frame;
  return header;
}

geometry_msgs::TransformStamped makeTransform(const ros::Time& stamp, const char* parent, const char* child,
                                              const Eigen::Isometry3d& T_parent_child) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_parent_child);
  message.header = makeHeader(stamp, parent);
  message.child_frame_id = child;
  return message;
}

sensor_msgs::Image makeImage(const std_msgs::Header& header, const cv::Mat& image) {
  sensor_msgs::Image message;
  message.header = header;
  sensor_msgs::fillImage(message, "mono8", static_cast<std::uint32_t>(image.rows),
                         static_cast<std::uint32_t>(image.cols), static_cast<std::uint32_t>(image.step), image.data);
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

/// A recorded drive as a bag: pairs of images with their calibrations under /stereo, /tf_static from base_link to both
/// cameras and, where the poses are known, /ground_truth/path and /ground_truth/odom. It gets its name when it is
/// complete, and replaces no file but an empty one. Throws std::runtime_error that names the file.
class StereoBag {
 public:
  /// `camera`: of the rectified views; `camera_poses`: those of the rectified left one at each stamp, or none.
  StereoBag(const std::string& path, std::vector<ros::Time> stamps, const StereoCamera& camera,
            const Trajectory& camera_poses)
      : name_("--output '" + path + "'"),
        caller_("/convert"),
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

  /// Pair i as left|right/`image_topic` with its calibrations, whose headers are filled here.
  void write(std::size_t i, const std::string& image_topic, const ImagePair& pair, sensor_msgs::CameraInfo left,
             sensor_msgs::CameraInfo right) {
    const ros::Time& stamp = stamps_[i];
    const std_msgs::Header header = makeHeader(stamp, kLeftFrame);
    left.header = right.header = header;
    write("/stereo/left/camera_info", stamp, left);
    write("/stereo/right/camera_info", stamp, right);
    write("/stereo/left/" + image_topic, stamp, makeImage(header, pair.left));
    write("/stereo/right/" + image_topic, stamp, makeImage(header, pair.right));
    if (!base_poses_.empty()) write("/ground_truth/odom", stamp, makeOdometry(stamps_, base_poses_, i));
  }

  /// The bag is complete.
  void commit() {
    guard("write", [&] {
      bag_.close();
      file_.commit();
    });
  }

 private:
  static std::string newFile(const std::string& path) {
    if (std::filesystem::is_regular_file(path) && !std::filesystem::is_empty(path))
      throw std::runtime_error("--output '" + path + "' exists and stays: give another name, or remove it");
    return std::filesystem::absolute(path).string();
  }

  template <class Action>
  std::invoke_result_t<Action> guard(const std::string& what, const Action& action) const try {
    return action();
  } catch (const std::exception& e) {
    throw std::runtime_error(name_ + ": cannot " + what + " (is the disk full?): " + e.what());
  }

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { bag_->write(topic, time, message); });
  }

  /// `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = caller_;
    (*header)["latching"] = "1";
    (*header)["type"] = ros::message_traits::datatype<Message>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
    (*header)["message_definition"] = ros::message_traits::definition<Message>();
    guard("write", [&] { bag_->write(topic, time, message, header); });
  }

  const std::string name_, caller_;
  WholeFile file_;
  OutputBag bag_;
  std::vector<ros::Time> stamps_;
  Trajectory base_poses_;  ///< in the odom frame, which is the base's frame at the first stamp
};

struct Arguments {
  std::string input, output;
  std::string poses;  ///< empty: look beside the input
  StereoSource source;
  int frames = std::numeric_limits<int>::max();
};

/// True poses of the rectified left camera at each stamp; empty, with a note, where they are not known.
Trajectory groundTruth(const Arguments& arguments, const Recording& recording, const std::vector<std::int64_t>& stamps) {
  const auto mav0 = findMav0(arguments.input);
  Trajectory poses;
  std::string problem;
  if (mav0 && arguments.poses.empty()) {
    poses = EurocSequence(*mav0, arguments.source.calibration, arguments.source.fov).rectifiedPoses(problem);
    poses.resize(std::min(poses.size(), stamps.size()));
  } else if (const auto path = arguments.poses.empty() ? findKittiPoses(arguments.input) : arguments.poses) {
    for (const auto& pose : recording.truth(*path, stamps))
      if (pose) poses.push_back(*pose);
    if (poses.size() < stamps.size())
      problem = text(0, "'", *path, "' has poses for ", poses.size(), " of ", stamps.size(), " pairs alone");
  } else {
    problem = "no poses file beside '" + arguments.input + "' and no --poses";
  }
  if (problem.empty()) return poses;
  std::cerr << "note: " << problem << ", so there is no ground truth" << std::endl;
  return {};
}

/// A bag of the images as a folder has them. `geometry`: of the rectified images or what rectifies raw ones.
template <class Sequence, class Geometry>
void writeBag(const Arguments& arguments, const Sequence& sequence, const Geometry& geometry,
              const StereoCamera& rectified, std::int64_t epoch, const std::string& topic) {
  const auto left = toCameraInfo(geometry, 0), right = toCameraInfo(geometry, 1);
  const int frames = std::min(arguments.frames, sequence.size());
  std::vector<ros::Time> stamps;
  std::vector<std::int64_t> of_sequence;
  for (int i = 0; i < frames; ++i) {
    of_sequence.push_back(sequence.stamp(i));
    stamps.push_back(ros::Time().fromNSec(static_cast<std::uint64_t>(epoch + sequence.stamp(i))));
  }
  const auto recording = openRecording({arguments.input}, arguments.source);
  StereoBag bag(arguments.output, stamps, rectified, groundTruth(arguments, *recording, of_sequence));
  Progress progress("writing bag", frames);
  for (int i = 0; i < frames; ++i, progress.step())
    bag.write(static_cast<std::size_t>(i), topic, sequence.load(i), left, right);
  bag.commit();
}

void writeBag(const Arguments& arguments) {
  if (const auto mav0 = findMav0(arguments.input)) {
    const EurocSequence sequence(*mav0, arguments.source.calibration, arguments.source.fov);
    if (sequence.unpaired() > 0)
      std::cerr << "note: " << sequence.unpaired() << " image(s) without a partner are left out" << std::endl;
    return writeBag(arguments, sequence, sequence.rectification(), sequence.rectification().camera(), 0, "image_raw");
  }
  const StereoSource& source = arguments.source;
  const KittiSequence sequence(arguments.input, KittiCameras::kAny, {source.calibration, source.fov, source.rate});
  const std::int64_t epoch = sequence.stamp(0) < kEpoch ? kEpoch : 0;  // KITTI raw has the time of day
  if (const StereoRectification* raw = sequence.rectification())
    writeBag(arguments, sequence, *raw, sequence.camera(), epoch, "image_raw");
  else
    writeBag(arguments, sequence, sequence.camera(), sequence.camera(), epoch, "image_rect");
}

/// A folder in KITTI's layout, of rectified images.
void writeFolder(const Arguments& arguments) {
  const auto recording = openRecording({arguments.input}, arguments.source);
  KittiWriter output(arguments.output);
  std::vector<std::int64_t> stamps;
  StereoCamera camera;
  int left_out = 0;
  {
    Progress progress("writing images", std::min(arguments.frames, recording->size()));
    left_out = recording->forEach(arguments.frames, [&](const RecordedPair& pair) {
      const int i = static_cast<int>(stamps.size());
      if (i > 0 && pair.camera != camera)
        throw std::runtime_error("the calibration changes in pair " + std::to_string(i));
      output.writeImage(0, i, pair.left);
      output.writeImage(1, i, pair.right);
      camera = pair.camera;
      stamps.push_back(pair.stamp);
      progress.step();
    });
  }
  if (left_out > 0) std::cerr << "note: " << left_out << " stamp(s) without a usable pair are left out" << std::endl;
  const Trajectory poses = groundTruth(arguments, *recording, stamps);
  const std::int64_t first = stamps.front();
  for (std::int64_t& stamp : stamps) stamp -= first;
  output.finish(camera, stamps, poses);
  std::printf("%zu pairs of %dx%d px, f = %.3f px, baseline = %.5f m, first stamp %lld ns\n", stamps.size(),
              camera.width, camera.height, camera.fx, camera.baseline, static_cast<long long>(first));
}

int convert(const Arguments& arguments) {
  const bool is_to_bag = std::filesystem::path(arguments.output).extension() == ".bag";
  is_to_bag ? writeBag(arguments) : writeFolder(arguments);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Converts a recorded drive.\n\n"
      "convert FOLDER --output NAME.bag\n"
      "  FOLDER of KITTI, EuRoC or TUM-VI. The bag has images (raw ones stay raw) and CameraInfo on\n"
      "  /stereo/left|right/..., /tf_static and, where poses are known, /ground_truth/path and\n"
      "  /ground_truth/odom. Stamps of KITTI are times.txt plus 1e9 s.\n\n"
      "convert FOLDER_OR_BAG --output NEW_FOLDER\n"
      "  FOLDER of EuRoC or TUM-VI. The new one has KITTI's layout: rectified images, calib.txt, times.txt\n"
      "  (seconds since the first stamp) and, where they are known, poses.txt of the left camera.\n");
  Arguments arguments;
  app.add_option(
         "input", arguments.input,
         "folder of KITTI (image_0, image_1, calib.txt, times.txt), EuRoC or TUM-VI (mav0, or cam0 and cam1), or bag")
      ->required();
  app.add_option("--output", arguments.output, "NAME.bag, or folder to create")->required();
  app.add_option("--poses", arguments.poses,
                 "ground truth in KITTI format (default: poses.txt in a KITTI folder or ../../poses/NN.txt, "
                 "cam0_ground_truth.txt of EuRoC)");
  app.add_option("--frames", arguments.frames, "only the first N pairs")->check(CLI::Range(1, 1000000));
  arguments.source.addTo(app);
  return sdvo::runTool(app, argc, argv, [&] { return convert(arguments); });
}
