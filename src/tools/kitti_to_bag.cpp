#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "run_tool.hpp"
#include "stereo_bag.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace {

// KITTI's times start at 0, which ROS reads as "no time": all stamps are times.txt plus this.
constexpr std::int64_t kEpoch = 1000000000LL * 1000000000LL;  // ns

ros::Time toRosTime(std::int64_t stamp) {
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(kEpoch + stamp));
  return time;
}

/// Calibration of an image that is rectified already: no distortion, no rotation, K the left part of P. As in
/// image_pipeline both views are expressed in the left optical frame; the right one's place is in P's Tx =
/// -fx*baseline.
sensor_msgs::CameraInfo makeCameraInfo(const sdvo::StereoCamera& camera, double tx) {
  sensor_msgs::CameraInfo message;
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.distortion_model = "plumb_bob";
  message.D.assign(5, 0.0);
  message.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  message.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  message.P = {camera.fx, 0.0, camera.cx, tx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return message;
}

struct Arguments {
  std::string sequence;
  std::string poses;  ///< empty: look beside the sequence
  int frames = 0;     ///< 0: all
  std::string output;
};

/// True poses of the left camera in the first `frames` frames; empty, with a note, when there is no ground truth.
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
  return {camera_poses.begin(), camera_poses.begin() + frames};
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

  const sdvo::StereoCamera& camera = sequence.camera();
  sdvo::StereoBag bag(arguments.output, "kitti_to_bag", stamps, camera, poses);
  sdvo::Progress progress("writing bag", frames);
  for (int i = 0; i < frames; ++i) {
    bag.write(static_cast<std::size_t>(i), "image_rect", sequence.load(i), makeCameraInfo(camera, 0.0),
              makeCameraInfo(camera, -camera.fx * camera.baseline));
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
