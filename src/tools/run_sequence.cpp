// Runs the odometry on a sequence in KITTI layout without ROS: the same core as the nodelets, every pair processed.
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
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace {

struct Arguments {
  std::string sequence, config, poses, timing, states;
  std::vector<std::string> settings;
  int frames = 0;
  int threads = 1;
};

int runSequence(const Arguments& arguments) {
  sdvo::PipelineOptions options = sdvo::readPipelineOptions(arguments.config, arguments.settings);
  const sdvo::KittiSequence sequence(arguments.sequence);
  const int count = arguments.frames > 0 ? std::min(arguments.frames, sequence.size()) : sequence.size();
  cv::setNumThreads(arguments.threads);
  sdvo::OfflineRun run(options);
  {
    sdvo::Progress progress("odometry", count);
    for (int i = 0; i < count; ++i, progress.step()) {
      const sdvo::ImagePair pair = sequence.load(i);
      if (arguments.threads > 1)
        run.processBeside(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
      else
        run.process(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
    }
    run.finish();
  }
  sdvo::writeKittiPoses(arguments.poses, run.poses());
  if (!arguments.timing.empty()) run.writeTiming(arguments.timing);
  if (!arguments.states.empty()) run.writeStates(arguments.states);

  std::cout << std::fixed << std::setprecision(1) << "options " << sdvo::hashOptions(sdvo::listOptions(options)) << "\n"
            << count << " pairs, " << run.pairsWithoutPose() << " without a pose, " << run.distance()
            << " m travelled\n"
            << "time per pair: median " << run.time(0.5) << " ms, p95 " << run.time(0.95) << " ms, CPU "
            << run.cpuTime() << " ms (decoding excluded)\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Stereo odometry of a sequence in KITTI layout; writes poses of the left camera in KITTI format");
  Arguments arguments;
  app.add_option("sequence", arguments.sequence, "directory with image_0, image_1, calib.txt, times.txt")->required();
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings,
                 "option as name=value, for example detector/max_features=800; repeatable")
      ->allow_extra_args(false);
  app.add_option("--frames", arguments.frames, "process only the first N pairs")->check(CLI::Range(1, 1000000));
  app.add_option("--threads", arguments.threads,
                 "threads of OpenCV; more than one: odometry of a pair beside the features of the next")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  app.add_option("--poses", arguments.poses, "poses to write, 12 numbers a line")->required();
  app.add_option("--timing", arguments.timing, "CSV to write, a line for each pair: times, counts, state and its reason");
  app.add_option("--states", arguments.states,
                 "CSV to write, a line for each pair: state, covariances of motion and pose, reason");
  return sdvo::runTool(app, argc, argv, [&] { return runSequence(arguments); });
}
