#include <cstdint>
#include <cstdio>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/euroc_dataset.hpp"
#include "stereo_descriptor_vo/data/kitti_writer.hpp"

namespace {

void writeImages(const sdvo::EurocSequence& sequence, const sdvo::KittiWriter& output) {
  cv::Mat map_x[2], map_y[2];
  for (int side = 0; side < 2; ++side) {
    const sdvo::EurocCamera& camera = sequence.camera(side);
    const sdvo::StereoRectification& rectification = sequence.rectification();
    cv::initUndistortRectifyMap(camera.intrinsics, camera.distortion, rectification.rotations[side],
                                rectification.projections[side], camera.size, CV_32FC1, map_x[side], map_y[side]);
  }
  sdvo::Progress progress("rectifying", sequence.size());
  for (int i = 0; i < sequence.size(); ++i, progress.step()) {
    const sdvo::ImagePair raw = sequence.load(i);
    for (int side = 0; side < 2; ++side) {
      cv::Mat image;
      cv::remap(side == 0 ? raw.left : raw.right, image, map_x[side], map_y[side], cv::INTER_LINEAR);
      output.writeImage(side, i, image);
    }
  }
}

void convert(const std::string& input, const std::string& output_path) {
  const sdvo::EurocSequence sequence(input);
  if (sequence.unpaired() > 0)
    std::cerr << "note: " << sequence.unpaired() << " image(s) without a partner are left out" << std::endl;
  std::string problem;
  const sdvo::Trajectory poses = sequence.rectifiedPoses(problem);
  if (poses.empty()) std::cerr << "note: " << problem << ", so poses.txt is not written" << std::endl;

  sdvo::KittiWriter output(output_path);
  writeImages(sequence, output);
  std::vector<std::int64_t> since_first;
  for (int i = 0; i < sequence.size(); ++i) since_first.push_back(sequence.stamp(i) - sequence.stamp(0));
  const sdvo::StereoCamera& camera = sequence.rectification().camera;
  output.finish(camera, since_first, poses);
  std::printf("%d pairs of %dx%d px, f = %.3f px, baseline = %.5f m, first stamp %lld ns\n", sequence.size(),
              camera.width, camera.height, camera.fx, camera.baseline, static_cast<long long>(sequence.stamp(0)));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Rectifies an EuRoC (ASL) folder into the KITTI layout: image_0, image_1, calib.txt, times.txt (seconds since "
      "the first stamp) and, where cam0_ground_truth.txt exists, poses.txt of the rectified left camera.");
  std::string input, output;
  app.add_option("--input", input, "The mav0 folder with cam0 and cam1")->required();
  app.add_option("--output", output, "Directory to create")->required();
  return sdvo::runTool(app, argc, argv, [&] {
    convert(input, output);
    return 0;
  });
}
