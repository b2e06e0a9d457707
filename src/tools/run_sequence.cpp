// Runs the odometry on recorded drives without a ROS master: the same core as the nodelets, every pair processed.
#include <ros/time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../check/camera_check.hpp"
#include "../common/progress.hpp"
#include "../common/text.hpp"
#include "../config/pipeline_options.hpp"
#include "../data/image_file.hpp"
#include "../data/text_file.hpp"
#include "drive_page.hpp"
#include "feature_halves.hpp"
#include "offline_run.hpp"
#include "place_run.hpp"
#include "recording.hpp"
#include "run_tool.hpp"
#include "self_check.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace {

using namespace sdvo;

constexpr int kAll = std::numeric_limits<int>::max();

struct Arguments {
  std::vector<std::string> inputs, before, settings;
  std::string config, format, poses, timing, states, output, odometry, keyframes, truth, page, live, pictures,
      base_frame;
  StereoSource source;
  int frames = kAll, threads = 1;
  bool join = false, places = false, shuttle = false, halves = false;
};

/// The odometry on a recording, and on two halves of its features.
struct Drive {
  OfflineRun whole, first, second;
  int left_out = 0;  ///< stamps without a usable pair

  explicit Drive(const PipelineOptions& options) : whole(options), first(options), second(options) {}
};

/// Parts of the page that are made while the images of a pair are in memory.
struct Seen {
  CameraCheck check;
  DrivePictures pictures;
};

void follow(Recording& recording, const Arguments& arguments, Drive& drive, PlaceRun* places, Seen* seen = nullptr) {
  FeatureHalves halves;
  Progress progress(places ? "places" : "odometry", std::min(arguments.frames, recording.size()));
  drive.left_out = recording.forEach(arguments.frames, [&](const RecordedPair& pair) {
    if (arguments.threads > 1 && !places && !arguments.halves && !seen && arguments.pictures.empty()) {
      drive.whole.processBeside(pair.camera, pair.left, pair.right, pair.stamp, pair.right_delay);
    } else {
      const StereoFeatures features = drive.whole.process(pair.camera, pair.left, pair.right, pair.stamp, pair.right_delay);
      if (places) places->process(features, drive.whole.last());
      if (!arguments.pictures.empty()) {
        std::ostringstream name;
        name << std::setw(6) << std::setfill('0') << drive.whole.pairs() - 1 << ".jpg";
        writeImage(fs::path(arguments.pictures) / name.str(), drawLeft(pair, features, drive.whole.last()));
      }
      if (seen) seen->check.add(pair, features, drive.whole.last()), seen->pictures.add(pair, features, drive.whole.last());
      if (arguments.halves) {
        const auto halved = halves.split(features, drive.whole.last().flow);
        drive.first.processFeatures(features.select(halved[0]));
        drive.second.processFeatures(features.select(halved[1]));
      }
    }
    progress.step();
  });
  drive.whole.finish();
}

std::vector<SelfCheck> checkItself(const Recording& recording, const Drive& drive, const PipelineOptions& options,
                                   const Arguments& arguments) {
  std::vector<SelfCheck> checks;
  if (arguments.shuttle) {
    OfflineRun back(options);
    Progress progress("backwards", drive.whole.pairs());
    recording.forEachBackwards([&](const RecordedPair& pair) {
      back.process(pair.camera, pair.left, pair.right, pair.stamp, pair.right_delay);
      progress.step();
    });
    checks.push_back(checkShuttle(drive.whole, back));
  }
  if (arguments.halves) checks.push_back(checkHalves(drive.whole, drive.first, drive.second));
  return checks;
}

/// `poses`: of each pair.
void writePoses(const std::string& path, const std::string& format, const OfflineRun& run, const Trajectory& poses) {
  format == "tum" ? writeTumPoses(path, run.stamped(poses)) : writeKittiPoses(path, poses);
}

void printSummary(const OfflineRun& run, PipelineOptions options) {
  const PairTimes times = run.times();
  std::cout << "options " << hashOptions(listOptions(options)) << " (a hash: of equal options it is equal)\n"
            << run.pairs() << " pairs, " << run.pairsWithoutPose() << " without a pose, " << run.distance()
            << " m travelled\n"
            << "time per pair: median " << times.median << " ms, p95 " << times.late << " ms, CPU " << times.cpu
            << " ms (decoding excluded)\n";
}

/// `way`: m, of all recordings.
void printSummary(const OfflineRun& run, const PlaceRun& places, double way) {
  const PlaceRecognition& recognition = places.recognition();
  const auto kept = static_cast<double>(std::max<std::size_t>(recognition.places().size(), 1));
  const double bytes = static_cast<double>(recognition.bytes()) / kept;
  std::cout << run.pairs() << " pairs, " << run.distance() << " m, " << recognition.places().size() << " key frames of "
            << bytes / 1e3 << " kB, " << way / kept * 1e6 / bytes << " km per GB, " << recognition.graph().loops()
            << " loops, turns measured too small by " << std::setprecision(2) << 100.0 * recognition.graph().turnError()
            << " %\n"
            << "time per key frame: median " << places.keyframeTime(0.5) << " ms, p95 " << places.keyframeTime(0.95)
            << " ms; longest optimisation " << places.longestOptimisation() << " ms; CPU per pair, all included, "
            << places.cpuTime() << " ms\n";
}

void printErrors(const PlaceErrors& errors) {
  std::cout << std::setprecision(3) << "revisits " << errors.revisits << ", recognised " << errors.recognised
            << "; loops " << errors.loops << ", false " << errors.false_loops << ", worst " << errors.worst_translation
            << " m " << errors.worst_rotation << " deg\n"
            << "ATE before " << errors.ate_before << " m, after " << errors.ate_after << " m\n";
}

std::vector<std::int64_t> stampsOf(const OfflineRun& run) {
  std::vector<std::int64_t> stamps;
  for (const auto& frame : run.frames()) stamps.push_back(frame.odometry.stamp);
  return stamps;
}

/// The true pose of each pair.
Trajectory wholeTruth(const Recording& recording, const OfflineRun& run, const std::string& path) {
  Trajectory poses;
  for (const auto& pose : recording.truth(path, stampsOf(run))) {
    if (!pose) throw std::runtime_error(text(0, "file '", path, "' has no pose of pair ", poses.size()));
    poses.push_back(*pose);
  }
  return poses;
}

Finding makePage(const Recording& recording, const Drive& drive, const Seen& seen, const std::vector<SelfCheck>& checks,
                 const PipelineOptions& options, const Arguments& arguments) {
  const std::string& input = arguments.inputs.front();
  const ArrivalFindings arrivals = recording.arrivals(arguments.base_frame);
  DriveReport report;
  report.name = fs::absolute(input).lexically_normal().string();
  report.left_out = drive.left_out;
  report.options = options;
  report.steps = seen.check.steps(arrivals, drive.whole.times());
  report.rows = seen.check.rows();
  // An optical frame looks along z, with x to the right.
  report.R_base_camera << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  if (arrivals.T_base_camera) report.R_base_camera = arrivals.T_base_camera->linear();
  report.self_checks = checks;
  report.pictures = seen.pictures.pictures();
  if (!arguments.truth.empty()) report.truth = recording.truth(arguments.truth, stampsOf(drive.whole));
  if (const std::string live = arguments.live.empty() ? input : arguments.live; fs::is_regular_file(live)) {
    rosbag::Bag bag;
    openBag(live, bag);
    try {
      report.live = ofBag(live, [&] { return readLiveRecord(bag); });
    } catch (const std::runtime_error& e) {
      std::cerr << "note: " << e.what() << "; the page lacks what the odometry reported while it ran" << std::endl;
    }
  }
  writeDrivePage(arguments.page, report, drive.whole);
  return judge(report, drive.whole);
}

std::string reportOf(const Arguments& arguments) {
  return (fs::path(arguments.output) / "report.csv").string();
}

/// The name of a recording: that of a bag without ".bag", that of a folder.
std::string nameOf(const std::string& input) {
  fs::path path = fs::absolute(input).lexically_normal();
  while (path.filename().empty() || path.filename() == "mav0") path = path.parent_path();
  return path.extension() == ".bag" ? path.stem().string() : path.filename().string();
}

/// Below --output, without extension.
std::string baseOf(const Arguments& arguments) {
  return (fs::path(arguments.output) / nameOf(arguments.inputs.front())).string();
}

/// NAME.txt, NAME.csv and report.csv, for people and for run_many, which joins these reports.
void writeResults(const Drive& drive, const std::vector<SelfCheck>& checks, PipelineOptions options,
                  const Arguments& arguments) {
  const OfflineRun& run = drive.whole;
  const std::string name = nameOf(arguments.inputs.front()), base = baseOf(arguments);
  writePoses(base + ".txt", arguments.format.empty() ? "tum" : arguments.format, run, run.poses());
  run.writeTiming(base + ".csv");
  fs::remove(base + ".self_check.csv");  // of an earlier run
  std::string rows = std::string(SelfCheck::columns()) + "\n";
  for (const SelfCheck& check : checks) rows += check.row() + "\n";
  if (!checks.empty()) writeTextFile(base + ".self_check.csv", rows);
  const PairTimes times = run.times();
  std::ostringstream report;
  report << "bag,pairs,without_pose,discontinuities,left_out,distance_m,median_ms,p95_ms,cpu_ms,options,problem\n"
         << std::fixed << std::setprecision(1) << name << "," << run.pairs() << "," << run.pairsWithoutPose() << ","
         << run.discontinuities() << "," << drive.left_out << "," << run.distance() << "," << times.median << ","
         << times.late << "," << times.cpu << "," << hashOptions(listOptions(options)) << ",\n";
  writeTextFile(reportOf(arguments), report.str());
}

/// An output must replace neither true poses, whose format is the same, nor another output.
void refuseOutputsThatReplace(const Arguments& arguments) {
  std::set<fs::path> taken;
  const auto take = [&](const fs::path& path) { return taken.insert(fs::weakly_canonical(path)).second; };
  take(arguments.truth);
  for (const auto& recordings : {arguments.inputs, arguments.before})
    for (const std::string& recording : recordings)
      if (const auto poses = findKittiPoses(recording)) take(*poses);
  const std::string results = arguments.output.empty() ? "" : baseOf(arguments) + ".txt";
  for (const std::string& output : {arguments.poses, arguments.odometry, arguments.timing, arguments.states,
                                    arguments.keyframes, arguments.page, results})
    if (!output.empty() && !take(output) && fs::is_regular_file(output))
      throw std::runtime_error("'" + output + "' has true poses, or is another output: give another name");
}

void refuseContradictions(const Arguments& arguments) {
  const bool has_page = !arguments.page.empty();
  const bool is_of_places = !(arguments.before.empty() && arguments.odometry.empty() && arguments.keyframes.empty());
  if (is_of_places && !arguments.places) throw std::runtime_error("--before, --odometry and --keyframes need --places");
  if (!arguments.truth.empty() && !arguments.places && !has_page)
    throw std::runtime_error("--ground-truth needs --page or --places");
  if (arguments.places && arguments.poses.empty()) throw std::runtime_error("--places needs --poses");
  if (arguments.poses.empty() && !has_page && arguments.output.empty())
    throw std::runtime_error("--page, --poses or --output is needed (see --help)");
  if (arguments.inputs.size() > 1 && !arguments.join)
    throw std::runtime_error(
        "several recordings are run_many's; --join where they are parts of one drive (see --help)");
}

void prepareFolders(const Arguments& arguments) {
  for (const std::string& folder : {arguments.pictures, arguments.output}) {
    std::error_code error;
    if (!folder.empty()) fs::create_directories(folder, error);
    if (error) throw std::runtime_error("cannot create folder '" + folder + "': " + error.message());
  }
  if (!arguments.pictures.empty() && !fs::is_empty(arguments.pictures))
    throw std::runtime_error("--pictures '" + arguments.pictures + "' is not empty: choose another folder");
  if (!arguments.output.empty()) fs::remove(reportOf(arguments));  // of an earlier run
}

/// The files that are asked for, each by its name.
void writeFiles(const OfflineRun& run, const PlaceRun* places, const Arguments& arguments) {
  if (!arguments.poses.empty())
    writePoses(arguments.poses, arguments.format, run, places ? places->poses() : run.poses());
  if (!arguments.odometry.empty()) writePoses(arguments.odometry, arguments.format, run, run.poses());
  if (!arguments.timing.empty()) run.writeTiming(arguments.timing);
  if (!arguments.states.empty()) run.writeStates(arguments.states);
  if (!arguments.keyframes.empty()) places->writeKeyframes(arguments.keyframes);
}

int run(const Arguments& arguments) {
  refuseOutputsThatReplace(arguments);
  refuseContradictions(arguments);
  cv::setNumThreads(arguments.threads);
  const PipelineOptions options = readPipelineOptions(arguments.config, arguments.settings);
  StereoSource source = arguments.source;
  source.pairing = options.pairing;
  std::optional<PlaceRun> places;
  if (arguments.places) places.emplace(options.place_recognition);
  double way = 0.0;  // m, of all recordings
  for (const std::string& before : arguments.before) {
    Arguments whole = arguments;
    whole.frames = kAll;
    Drive drive(options);
    follow(*openRecording({before}, source), whole, drive, &*places);
    way += drive.whole.distance();
    places->startSequence();
  }
  prepareFolders(arguments);
  const auto recording = openRecording(arguments.inputs, source);
  Drive drive(options);
  std::optional<Seen> seen;
  if (!arguments.page.empty())
    seen.emplace(Seen{CameraCheck(options), DrivePictures(std::min(arguments.frames, recording->size()))});
  follow(*recording, arguments, drive, places ? &*places : nullptr, seen ? &*seen : nullptr);
  const OfflineRun& run = drive.whole;
  writeFiles(run, places ? &*places : nullptr, arguments);
  std::cout << std::fixed << std::setprecision(1);
  places ? printSummary(run, *places, way + run.distance()) : printSummary(run, options);
  if (places && !arguments.truth.empty()) printErrors(places->errors(wholeTruth(*recording, run, arguments.truth)));
  if (drive.left_out > 0) std::cout << drive.left_out << " stamps without a usable pair\n";
  if (drive.left_out > 0 && !arguments.poses.empty() && arguments.format != "tum")
    std::cerr << "note: lines of --poses are of used pairs alone: where a truth has a line for each image, --format tum "
                 "compares by stamps" << std::endl;
  if (!run.mosaic().empty()) std::cerr << "warning: " << run.mosaic() << std::endl;
  const std::vector<SelfCheck> checks = checkItself(*recording, drive, options, arguments);
  for (const SelfCheck& check : checks) std::cout << check.text() << "\n";
  if (!arguments.output.empty()) writeResults(drive, checks, options, arguments);
  if (!seen) return 0;
  const Finding verdict = makePage(*recording, drive, *seen, checks, options, arguments);
  std::cout << toString(verdict.verdict) << ": " << verdict.text() << "\npage: " << arguments.page << "\n";
  return exitCodeOf(verdict.verdict);
}

}  // namespace

int main(int argc, char** argv) {
  ros::Time::init();  // message_filters, by which approximate_sync pairs, asks for the time
  CLI::App app(
      "Stereo odometry of a recorded drive, every pair: a bag, a folder in the layout of KITTI, EuRoC or TUM-VI. Raw "
      "images are rectified. Writes the files that are asked for, such as a --page to look at. Exit code 2: its "
      "verdict "
      "is FAIL. Many drives: run_many");
  Arguments arguments;
  app.add_option("recordings", arguments.inputs,
                 "bag, folder with image_0, image_1, calib.txt, times.txt, or another one of docs/tools.md")
      ->required();
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings,
                 "option as name=value, for example detector/max_features=800; repeatable")
      ->allow_extra_args(false);
  app.add_option("--frames", arguments.frames, "process only the first N pairs")->check(CLI::Range(1, 1000000));
  app.add_option("--threads", arguments.threads,
                 "threads of OpenCV; more than one: odometry of a pair beside the features of the next")
      ->capture_default_str()
      ->check(CLI::Range(1, 256));
  arguments.source.addTo(app);
  app.add_flag("--join", arguments.join, "the bags are parts of one drive, as of rosbag record --split");

  app.add_option("--page", arguments.page,
                 "HTML page to write: verdict, camera's check, path, states, deviations, times, what the recording "
                 "implies of its error (--shuttle and --halves), images");
  app.add_option("--base-frame", arguments.base_frame,
                 "page: the robot's frame on TF; empty: that of the bag's odometry, else base_link");
  app.add_option("--live", arguments.live, "page: bag with vo_info of the drive as it ran; default: the recording")
      ->check(CLI::ExistingFile);
  app.add_option("--pictures", arguments.pictures, "folder of pictures to write: each left image with its features");
  app.add_option("--poses", arguments.poses, "poses to write, by --format");
  app.add_option(
         "--format", arguments.format,
         "of all poses: tum (those there are, with stamps; default of --output) or kitti (12 numbers a line for "
         "each pair; default of --poses)")
      ->check(CLI::IsMember({"tum", "kitti"}));
  app.add_option("--timing", arguments.timing,
                 "CSV to write, a line for each pair: times, counts, state and its reason");
  app.add_option("--states", arguments.states,
                 "CSV to write, a line for each pair: state, covariances of motion and pose, reason");
  app.add_option(
      "--output", arguments.output,
      "folder of results, made where it is missing: NAME.txt (poses), NAME.csv (as --timing) and report.csv");
  app.add_flag("--shuttle", arguments.shuttle,
               "runs each drive backwards, too: says how far from its start it ends (NAME.self_check.csv)");
  app.add_flag("--halves", arguments.halves,
               "runs on two halves of the features, too: says how far they differ (NAME.self_check.csv)");

  app.add_flag("--places", arguments.places, "recognises places, too: --poses are those in the map");
  app.add_option("--before", arguments.before, "places: recordings of other places driven before; repeatable")
      ->allow_extra_args(false);
  app.add_option("--odometry", arguments.odometry, "places: poses of the odometry to write, by --format");
  app.add_option("--keyframes", arguments.keyframes, "places: CSV to write, a line for each key frame");
  app.add_option(
      "--ground-truth", arguments.truth,
      "true poses of the left camera, KITTI's format (a line for each pair) or TUM's, or of EuRoC's IMU (CSV). "
      "Page: errors over time. Places: prints how many revisits were found and what is false");
  return sdvo::runTool(app, argc, argv, [&] {
    if (!arguments.page.empty()) arguments.shuttle = arguments.halves = true;
    return run(arguments);
  });
}
