// Runs the odometry on a sequence in KITTI layout without ROS: the same core as the nodelets, every pair processed.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <stdexcept>

#include "../common/progress.hpp"
#include "../config/pipeline_options.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/common/stopwatch.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace {

struct Arguments {
  std::string sequence, config, poses, timing, states;
  std::vector<std::string> settings;
  int frames = 0;
  int threads = 1;
};

struct Frame {
  sdvo::OdometryResult odometry;
  sdvo::ExtractionReport extraction;
  double total_time = 0.0;  ///< s
};

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

void writeTiming(const std::string& path, const std::vector<Frame>& frames) {
  std::ofstream file(path);
  file << "frame,total_ms,detect_ms,stereo_ms,describe_ms,match_ms,motion_ms,detected,features,matches,inliers,rms_px,"
          "coverage,state\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto& [odometry, extraction, total_time] = frames[i];
    file << i << "," << 1e3 * total_time << "," << 1e3 * extraction.detect_time << "," << 1e3 * extraction.stereo_time
         << "," << 1e3 * extraction.describe_time << "," << 1e3 * odometry.match_time << ","
         << 1e3 * odometry.motion_time << "," << extraction.detected << "," << odometry.features << ","
         << odometry.matches << "," << odometry.inliers << "," << odometry.rms << "," << odometry.coverage << ","
         << toString(odometry.state) << "\n";
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

/// Row by row, 36 numbers.
void writeCovariance(std::ostream& file, const sdvo::Matrix6d& covariance) {
  for (int i = 0; i < 36; ++i) file << "," << covariance(i / 6, i % 6);
}

/// What a filter behind the odometry is told of each pair. The reason stands last, for it may hold commas.
void writeStates(const std::string& path, const std::vector<Frame>& frames) {
  std::ofstream file(path);
  file << "frame,stamp_ns,state,epoch,has_pose,has_motion";
  for (const char* name : {"motion", "pose"})
    for (int i = 0; i < 36; ++i) file << "," << name << "_" << i / 6 << i % 6;
  file << ",reason\n" << std::setprecision(10);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const sdvo::OdometryResult& odometry = frames[i].odometry;
    file << i << "," << odometry.stamp << "," << toString(odometry.state) << "," << odometry.epoch << ","
         << odometry.has_pose << "," << odometry.has_motion;
    writeCovariance(file, odometry.motion_covariance);
    writeCovariance(file, odometry.pose_covariance);
    file << "," << odometry.reason << "\n";
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

int run(const Arguments& arguments) {
  sdvo::PipelineOptions options = sdvo::readPipelineOptions(arguments.config, arguments.settings);
  const sdvo::KittiSequence sequence(arguments.sequence);
  const int count = arguments.frames > 0 ? std::min(arguments.frames, sequence.size()) : sequence.size();
  cv::setNumThreads(arguments.threads);
  const sdvo::FeatureExtractor extractor(options.stereo_features);
  sdvo::VisualOdometry odometry(options.visual_odometry);

  std::vector<Frame> frames;
  sdvo::Trajectory poses;
  int without_pose = 0;
  double cpu_time = 0.0;
  {
    sdvo::Progress progress("odometry", count);
    for (int i = 0; i < count; ++i, progress.step()) {
      const sdvo::ImagePair pair = sequence.load(i);
      Frame frame;
      const double cpu_before = cpuSeconds();
      sdvo::Stopwatch stopwatch;
      const sdvo::StereoFeatures features =
          extractor.extract(sequence.camera(), pair.left, pair.right, sequence.stamp(i));
      frame.odometry = odometry.update(features);
      frame.total_time = stopwatch.lap();
      cpu_time += cpuSeconds() - cpu_before;
      frame.extraction = features.report;
      // The format has one line for each pair: without a pose of its own a pair repeats the last one.
      if (frame.odometry.has_pose)
        poses.push_back(frame.odometry.T_origin_camera);
      else
        poses.push_back(poses.empty() ? Eigen::Isometry3d::Identity() : poses.back()), ++without_pose;
      frames.push_back(std::move(frame));
    }
  }
  sdvo::writeKittiPoses(arguments.poses, poses);
  if (!arguments.timing.empty()) writeTiming(arguments.timing, frames);
  if (!arguments.states.empty()) writeStates(arguments.states, frames);

  std::vector<double> times;
  for (const Frame& frame : frames) times.push_back(1e3 * frame.total_time);
  std::cout << std::fixed << std::setprecision(1) << "options " << sdvo::hashOptions(sdvo::listOptions(options)) << "\n"
            << count << " pairs, " << without_pose << " without a pose, " << frames.back().odometry.distance
            << " m travelled\n"
            << "time per pair: median " << quantile(times, 0.5) << " ms, p95 " << quantile(times, 0.95) << " ms, CPU "
            << 1e3 * cpu_time / count << " ms (decoding excluded)\n";
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
  app.add_option("--threads", arguments.threads, "threads of OpenCV")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_option("--poses", arguments.poses, "poses to write, 12 numbers a line")->required();
  app.add_option("--timing", arguments.timing, "CSV to write, a line for each pair");
  app.add_option("--states", arguments.states,
                 "CSV to write, a line for each pair: state, covariances of motion and pose, reason");
  return sdvo::runTool(app, argc, argv, [&] { return run(arguments); });
}
