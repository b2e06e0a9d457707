// Runs the odometry and the recognition of places on a sequence in KITTI layout without ROS, every pair processed.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <iomanip>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "../config/pipeline_options.hpp"
#include "offline_run.hpp"
#include "place_run.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace {

struct Arguments {
  std::string sequence, config, truth, odometry, poses, keyframes, views;
  std::vector<std::string> before, settings;
  int frames = 0;
};

void printErrors(const sdvo::PlaceErrors& errors) {
  std::cout << std::setprecision(3) << "revisits " << errors.revisits << ", recognised " << errors.recognised
            << "; loops " << errors.loops << ", false " << errors.false_loops << ", worst " << errors.worst_translation
            << " m " << errors.worst_rotation << " deg\n"
            << "ATE before " << errors.ate_before << " m, after " << errors.ate_after << " m\n";
}

void drive(const std::string& directory, int frames, sdvo::OfflineRun& odometry, sdvo::PlaceRun& places) {
  const sdvo::KittiSequence sequence(directory);
  const int count = frames > 0 ? std::min(frames, sequence.size()) : sequence.size();
  sdvo::Progress progress("places", count);
  for (int i = 0; i < count; ++i, progress.step()) {
    const sdvo::ImagePair pair = sequence.load(i);
    const sdvo::StereoFeatures features = odometry.process(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
    places.process(features, odometry.last());
  }
}

int runPlaces(const Arguments& arguments) {
  const sdvo::PipelineOptions options = sdvo::readPipelineOptions(arguments.config, arguments.settings);
  cv::setNumThreads(1);
  sdvo::PlaceRun places(options.place_recognition);
  double way = 0.0;  // m, of all sequences
  for (const std::string& before : arguments.before) {
    sdvo::OfflineRun odometry(options);
    drive(before, 0, odometry, places);
    way += odometry.distance();
    places.startSequence();
  }
  sdvo::OfflineRun odometry(options);
  drive(arguments.sequence, arguments.frames, odometry, places);
  way += odometry.distance();
  sdvo::writeKittiPoses(arguments.poses, places.poses());
  if (!arguments.odometry.empty()) sdvo::writeKittiPoses(arguments.odometry, odometry.poses());
  if (!arguments.keyframes.empty()) places.writeKeyframes(arguments.keyframes);

  const sdvo::PlaceRecognition& recognition = places.recognition();
  const auto kept = static_cast<double>(std::max<std::size_t>(recognition.places().size(), 1));
  const double bytes = static_cast<double>(recognition.bytes()) / kept;
  std::cout << std::fixed << std::setprecision(1) << odometry.pairs() << " pairs, " << odometry.distance() << " m, "
            << recognition.places().size() << " key frames of " << bytes / 1e3 << " kB, "
            << way / kept * 1e6 / bytes << " km per GB, " << recognition.graph().loops()
            << " loops, turns measured too small by " << std::setprecision(2) << 100.0 * recognition.graph().turnError()
            << " %\n"
            << std::setprecision(2) << "time per key frame: median " << places.keyframeTime(0.5) << " ms, p95 "
            << places.keyframeTime(0.95) << " ms; longest optimisation " << places.longestOptimisation()
            << " ms; CPU per pair, all included, " << places.cpuTime() << " ms\n";
  if (arguments.truth.empty()) return 0;
  const sdvo::Trajectory truth = sdvo::readKittiPoses(arguments.truth);
  printErrors(places.errors(truth));
  if (!arguments.views.empty()) places.writeViews(arguments.views, truth);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Odometry and loops of a sequence in KITTI layout; writes poses of the left camera in the map");
  Arguments arguments;
  app.add_option("sequence", arguments.sequence, "directory with image_0, image_1, calib.txt, times.txt")->required();
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings,
                 "option as name=value, for example place_recognition/keyframe_distance=2; repeatable")
      ->allow_extra_args(false);
  app.add_option("--frames", arguments.frames, "process only the first N pairs")->check(CLI::Range(1, 1000000));
  app.add_option("--before", arguments.before, "sequences of other places that were driven before; repeatable")
      ->allow_extra_args(false);
  app.add_option("--poses", arguments.poses, "poses in the map to write, 12 numbers a line")->required();
  app.add_option("--odometry", arguments.odometry, "poses of the odometry to write, 12 numbers a line");
  app.add_option("--keyframes", arguments.keyframes, "CSV to write, a line for each key frame");
  CLI::Option* truth = app.add_option("--ground-truth", arguments.truth,
                                      "true poses: prints how many revisits were found and what is false");
  app.add_option("--views", arguments.views,
                 "CSV to write: what geometry says of each two key frames whose views overlap")
      ->needs(truth);
  return sdvo::runTool(app, argc, argv, [&] { return runPlaces(arguments); });
}
