// Converts recorded drives: a folder (KITTI, EuRoC) to a bag, or any recording to a folder in KITTI's layout.
#include <ros/time.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "pair_reader.hpp"
#include "recording.hpp"
#include "run_tool.hpp"
#include "stereo_bag.hpp"
#include "stereo_descriptor_vo/data/euroc_dataset.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace {

using namespace sdvo;

// KITTI's times start at 0, which ROS reads as "no time": all stamps are times.txt plus this.
constexpr std::int64_t kEpoch = 1000000000LL * 1000000000LL;  // ns

struct Arguments {
  std::string tool, input, output;
  std::string poses;  ///< empty: look beside the input
  StereoSource source;
  int frames = std::numeric_limits<int>::max();
};

/// True poses of the rectified left camera in each frame; empty, with a note, where they are not known.
Trajectory groundTruth(const Arguments& arguments, std::size_t frames) {
  const auto mav0 = findMav0(arguments.input);
  const std::optional<std::string> path =
      arguments.poses.empty() && !mav0 ? findKittiPoses(arguments.input) : arguments.poses;
  Trajectory poses;
  std::string problem;
  if (mav0 && arguments.poses.empty())
    poses = EurocSequence(*mav0, arguments.source.calibration, arguments.source.fov).rectifiedPoses(problem);
  else if (path)
    poses = readKittiPoses(*path);
  else
    problem = "no poses file beside '" + arguments.input + "' and no --poses";
  if (!problem.empty()) {
    std::cerr << "note: " << problem << ", so there is no ground truth" << std::endl;
    return {};
  }
  if (poses.size() < frames)
    throw std::runtime_error("file '" + *path + "' has " + std::to_string(poses.size()) + " poses for " +
                             std::to_string(frames) + " frames: does it belong to this sequence?");
  poses.resize(frames);
  return poses;
}

/// A bag of the images as a folder has them. `geometry`: of the rectified images or what rectifies raw ones.
template <class Sequence, class Geometry>
void writeBag(const Arguments& arguments, const Sequence& sequence, const Geometry& geometry,
              const StereoCamera& rectified, std::int64_t epoch, const std::string& topic) {
  const auto left = toCameraInfo(geometry, 0), right = toCameraInfo(geometry, 1);
  const int frames = std::min(arguments.frames, sequence.size());
  std::vector<ros::Time> stamps;
  for (int i = 0; i < frames; ++i)
    stamps.push_back(ros::Time().fromNSec(static_cast<std::uint64_t>(epoch + sequence.stamp(i))));
  StereoBag bag(arguments.output, arguments.tool, stamps, rectified, groundTruth(arguments, stamps.size()));
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
  const KittiSequence sequence(arguments.input);
  writeBag(arguments, sequence, sequence.camera(), sequence.camera(), kEpoch, "image_rect");
}

/// A folder in KITTI's layout, of rectified images.
void writeFolder(const Arguments& arguments) {
  const auto recording = openRecording(arguments.input, arguments.source);
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
  const Trajectory poses = groundTruth(arguments, stamps.size());
  const std::int64_t first = stamps.front();
  for (std::int64_t& stamp : stamps) stamp -= first;
  output.finish(camera, stamps, poses);
  std::printf("%zu pairs of %dx%d px, f = %.3f px, baseline = %.5f m, first stamp %lld ns\n", stamps.size(),
              camera.width, camera.height, camera.fx, camera.baseline, static_cast<long long>(first));
}

int convert(const Arguments& arguments) {
  const bool is_to_bag = std::filesystem::path(arguments.output).extension() == ".bag" ||
                         arguments.tool.find("_to_bag") != std::string::npos;
  is_to_bag ? writeBag(arguments) : writeFolder(arguments);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Converts a recorded drive. To NAME.bag from a folder of KITTI, EuRoC or TUM-VI: images (raw ones stay raw) and "
      "CameraInfo on /stereo/left|right/..., /tf_static and, where poses are known, /ground_truth/path and "
      "/ground_truth/odom; stamps of KITTI are times.txt plus 1e9 s. To a folder in KITTI's layout from an EuRoC or "
      "TUM-VI folder or a bag: rectified images, calib.txt, times.txt (seconds since the first stamp) and, where they "
      "are known, poses.txt of the left camera");
  Arguments arguments;
  arguments.tool = std::filesystem::path(argv[0]).filename().string();
  app.add_option(
         "input,--input,--sequence", arguments.input,
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
