#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "run_tool.hpp"
#include "stereo_bag.hpp"
#include "stereo_descriptor_vo/data/euroc_dataset.hpp"

namespace {

/// Of a raw image: what rectifies it, and what the rectified one is. The header is filled by the bag.
sensor_msgs::CameraInfo makeCameraInfo(const sdvo::EurocSequence& sequence, int side) {
  const sdvo::EurocCamera& camera = sequence.camera(side);
  const cv::Matx33d& R = sequence.rectification().rotations[side];
  const cv::Matx34d& P = sequence.rectification().projections[side];
  sensor_msgs::CameraInfo message;
  message.width = static_cast<std::uint32_t>(camera.size.width);
  message.height = static_cast<std::uint32_t>(camera.size.height);
  message.distortion_model = "plumb_bob";  // k1 k2 p1 p2 k3
  message.D = camera.distortion;
  message.D.push_back(0.0);
  std::copy(camera.intrinsics.val, camera.intrinsics.val + 9, message.K.begin());
  std::copy(R.val, R.val + 9, message.R.begin());
  std::copy(P.val, P.val + 12, message.P.begin());
  return message;
}

void convert(const std::string& input, const std::string& output) {
  const sdvo::EurocSequence sequence(input);
  if (sequence.unpaired() > 0)
    std::cerr << "note: " << sequence.unpaired() << " image(s) without a partner are left out" << std::endl;
  std::string problem;
  const sdvo::Trajectory poses = sequence.rectifiedPoses(problem);
  if (poses.empty()) std::cerr << "note: " << problem << ", so the bag has no ground truth" << std::endl;
  std::vector<ros::Time> stamps;
  for (int i = 0; i < sequence.size(); ++i)
    stamps.push_back(ros::Time().fromNSec(static_cast<std::uint64_t>(sequence.stamp(i))));

  sdvo::StereoBag bag(output, "euroc_to_bag", stamps, sequence.rectification().camera, poses);
  const sensor_msgs::CameraInfo infos[2] = {makeCameraInfo(sequence, 0), makeCameraInfo(sequence, 1)};
  sdvo::Progress progress("writing bag", sequence.size());
  for (int i = 0; i < sequence.size(); ++i, progress.step())
    bag.write(static_cast<std::size_t>(i), "image_raw", sequence.load(i), infos[0], infos[1]);
  bag.commit();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Writes an EuRoC (ASL) folder as a bag: raw images and CameraInfo (D, K, R, P) on /stereo/left|right/..., "
      "/tf_static and, where cam0_ground_truth.txt exists, /ground_truth/path and /ground_truth/odom of the rectified "
      "left camera.");
  std::string input, output;
  app.add_option("--input", input, "The mav0 folder with cam0 and cam1")->required();
  app.add_option("--output", output, "Bag file to write")->required();
  return sdvo::runTool(app, argc, argv, [&] {
    convert(input, output);
    return 0;
  });
}
