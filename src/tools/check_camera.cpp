// Checks the inputs of a stereo camera one by one, live or in a bag, and prints a remedy for each fault.
#include <image_transport/image_transport.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <CLI/CLI.hpp>
#include <iomanip>
#include <iostream>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "../check/camera_check.hpp"
#include "../common/worker.hpp"
#include "../messages/stamps.hpp"
#include "../ros/synchronisation/camera_finder.hpp"
#include "camera_input.hpp"
#include "offline_run.hpp"
#include "page.hpp"
#include "pair_reader.hpp"
#include "recording.hpp"
#include "run_tool.hpp"
#include "stereo_messages.hpp"

namespace {

using namespace sdvo;

/// All findings of a camera's check as one page that needs no other file: verdict, table, map of the rows, a pair of
/// images. `rows`: RowCheck::map(), empty: none; `pair`: CV_8U, empty: none. Throws std::runtime_error when it cannot
/// be written.
void writeCheckPage(const std::string& path, const std::string& camera, const std::vector<CheckStep>& steps,
                    const cv::Mat& rows, const cv::Mat& pair) {
  const CheckStep worst = worstOf(steps);
  const Verdict verdict = worst.finding.verdict;
  const std::string sentence = verdict == Verdict::kOk ? "OK: every step that this recording shows" : worst.text();
  constexpr std::size_t kMostBytes = 1000000;
  const std::string pictures = pair.empty() ? "[]" : "[" + pictureOf(pair, "left and right, with lines along the rows", kMostBytes) + "]";
  writePage(path, "Stereo camera " + camera, {verdict, sentence}, steps, rows, {{"pictures", pictures}});
}

struct Arguments {
  std::string bag, base_frame, transport = "raw", page, config;
  StereoSource source;
  std::vector<std::string> settings;
  double seconds = 30.0;
};

void listen(const Arguments& arguments, const StereoTopics& topics, CameraInput& input) {
  if (!ros::master::check())
    throw std::runtime_error("no ROS master at " + ros::master::getURI() + ": start the camera, or give a --bag");
  ros::NodeHandle nh;
  const image_transport::TransportHints hints(arguments.transport);
  constexpr std::uint32_t kQueue = 50;  // messages: a second of a fast camera
  image_transport::ImageTransport transport(nh);
  std::vector<image_transport::Subscriber> images;
  std::vector<ros::Subscriber> others;
  for (const std::size_t side : {0u, 1u}) {
    const auto add = [&, side](const sensor_msgs::ImageConstPtr& m) {
      input.add(toStereoMessage(side, ros::Time::now(), m));
    };
    images.push_back(transport.subscribe(topics[side], kQueue, add, {}, hints));
    if (arguments.source.calibration.empty())
      others.push_back(nh.subscribe<sensor_msgs::CameraInfo>(
          topics[side + 2], kQueue, [&, side](const sensor_msgs::CameraInfoConstPtr& m) {
            input.add(toStereoMessage(side + 2, ros::Time::now(), m));
          }));
  }
  for (const std::string topic : {"/tf", "/tf_static"})
    others.push_back(nh.subscribe<tf2_msgs::TFMessage>(
        topic, kQueue, [&, topic](const tf2_msgs::TFMessageConstPtr& m) { input.add(*m, topic == "/tf_static"); }));
  std::cerr << "Listening to " << topics[0] << " and " << topics[1] << " for " << arguments.seconds
            << " s: hold the camera still, then walk, turn and tilt it." << std::endl;
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(arguments.seconds);
  while (ros::ok() && ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
}

int check(const Arguments& arguments) {
  cv::setNumThreads(1);
  const PipelineOptions options = readPipelineOptions(arguments.config, arguments.settings);
  StereoSource source = arguments.source;
  source.pairing = options.pairing;
  OfflineRun run(options);
  CameraCheck check(options);
  const auto use = [&](const RecordedPair& pair) {
    const StereoFeatures features = run.process(pair.camera, pair.left, pair.right, pair.stamp, pair.right_delay);
    check.add(pair, features, run.last());
  };
  const auto report = [&](const std::string& camera, const ArrivalFindings& arrivals) {
    const std::vector<CheckStep> steps = check.steps(arrivals, run.times());
    for (const auto& [name, finding] : steps)
      std::cout << std::left << std::setw(5) << toString(finding.verdict) << std::setw(14) << name << finding.what
                << (finding.remedy.empty() ? "" : "\n" + std::string(19, ' ') + "-> " + finding.remedy) << "\n";
    if (!arguments.page.empty()) writeCheckPage(arguments.page, camera, steps, check.rows(), check.picture());
    return exitCodeOf(worstOf(steps).finding.verdict);
  };
  if (!arguments.bag.empty()) {
    const auto recording = openRecording({arguments.bag}, source);
    recording->forEach(std::numeric_limits<int>::max(), use, [&](const std::string& why) { check.addUnusable(why); });
    return report(arguments.bag, recording->arrivals(arguments.base_frame));
  }
  const StereoTopics topics = source.topics();
  const CameraInput* known = nullptr;  // set before the first pair
  PairReader reader(topics, source.fov,
                    [&](const std::string& parent, const std::string& child, std::string& problem) {
                      return known->find(parent, child, problem);
                    });
  std::int64_t last_stamp = 0;  // ns
  constexpr std::size_t kWaitingPairs = 100;
  Worker<ArrivedPair> worker(kWaitingPairs, [&](const ArrivedPair& pair) {
    if (pair.stamp <= last_stamp) return;  // which the step of the stamps reports
    try {
      RecordedPair read = reader.read(pair.messages, pair.stamp);
      read.right_delay = pair.right_delay;
      use(read);
      last_stamp = pair.stamp;
    } catch (const std::exception& e) {
      check.addUnusable(e.what());
    }
  });
  CameraInput input(topics, infosOf(source), source.pairing, [&](const ArrivedPair& pair) { worker.push(pair); });
  known = &input;
  listen(arguments, topics, input);
  worker.stop();
  ArrivalFindings findings = input.findings(arguments.base_frame, false);
  ros::master::V_TopicInfo published;
  if (findings.topics.verdict == Verdict::kFail && ros::master::getTopics(published))
    findings.topics.remedy += listStereoCameras(published);
  return report(topics[0], findings);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "check_camera", ros::init_options::AnonymousName);  // takes ROS's arguments away
  ros::Time::init();                                                        // for bags, which need no master
  CLI::App app(
      "Checks a stereo camera step by step, live or in a bag: topics, stamps, calibration, images, motion. "
      "Exit code 2: a step FAILs. For 30 s of a camera that is held still, walked, turned and tilted");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "recorded bag or folder; empty: listen to the topics")
      ->check(CLI::ExistingPath);
  arguments.source.addTo(app);
  app.add_option("--base-frame", arguments.base_frame,
                 "the robot's frame on TF; empty: that of the bag's odometry, else base_link");
  app.add_option("--seconds", arguments.seconds, "how long to listen, s")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  app.add_option("--transport", arguments.transport, "image transport to listen by")->capture_default_str();
  app.add_option("--page", arguments.page, "HTML page to write: verdict, table, map of the rows, a pair");
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings, "option as name=value; repeatable")->allow_extra_args(false);
  return sdvo::runTool(app, argc, argv, [&] { return check(arguments); });
}
