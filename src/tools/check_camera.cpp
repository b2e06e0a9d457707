// Goes through the inputs of a stereo camera one by one, live or in a bag, and says what to do about each.
#include <image_transport/image_transport.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <CLI/CLI.hpp>
#include <iomanip>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "../check/check_page.hpp"
#include "../ros/threads.hpp"
#include "camera_check.hpp"
#include "camera_input.hpp"
#include "run_tool.hpp"

namespace {

using sdvo::ArrivalLog;

struct Arguments {
  std::string bag, camera = "/stereo", left = "left", right = "right", image = "image_rect", base_frame = "base_link",
                   transport = "raw", page, config;
  std::vector<std::string> settings;
  double seconds = 30.0;

  sdvo::CameraInput::Topics topics() const {
    return {camera + "/" + left + "/" + image, camera + "/" + right + "/" + image, camera + "/" + left + "/camera_info",
            camera + "/" + right + "/camera_info"};
  }
};

void readBag(const Arguments& arguments, sdvo::CameraInput& input) {
  const auto topics = arguments.topics();
  std::vector<std::string> wanted(topics.begin(), topics.end());
  wanted.insert(wanted.end(), {"/tf", "/tf_static"});
  const rosbag::Bag bag(arguments.bag, rosbag::bagmode::Read);
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(wanted))) {
    const std::string& topic = instance.getTopic();
    if (const auto transforms = instance.instantiate<tf2_msgs::TFMessage>())
      input.add(*transforms, topic == "/tf_static");
    else if (const sensor_msgs::ImageConstPtr image = instance.instantiate<sensor_msgs::Image>())
      topic == topics[0] ? input.add<ArrivalLog::kLeftImage>(image, instance.getTime())
                         : input.add<ArrivalLog::kRightImage>(image, instance.getTime());
    else if (const sensor_msgs::CameraInfoConstPtr info = instance.instantiate<sensor_msgs::CameraInfo>())
      topic == topics[2] ? input.add<ArrivalLog::kLeftInfo>(info, instance.getTime())
                         : input.add<ArrivalLog::kRightInfo>(info, instance.getTime());
    else
      throw std::runtime_error(topic + " holds " + instance.getDataType() + ", which is no image, camera_info or TF");
  }
}

void listen(const Arguments& arguments, sdvo::CameraInput& input) {
  if (!ros::master::check())
    throw std::runtime_error("no ROS master at " + ros::master::getURI() + ": start the camera, or give a --bag");
  ros::NodeHandle nh;
  const image_transport::TransportHints hints(arguments.transport);
  constexpr std::uint32_t kQueue = 50;  // messages: a second of a fast camera
  const auto topics = arguments.topics();
  image_transport::ImageTransport images(nh);
  const auto left = images.subscribe(
      topics[0], kQueue,
      [&](const sensor_msgs::ImageConstPtr& m) { input.add<ArrivalLog::kLeftImage>(m, ros::Time::now()); }, {}, hints);
  const auto right = images.subscribe(
      topics[1], kQueue,
      [&](const sensor_msgs::ImageConstPtr& m) { input.add<ArrivalLog::kRightImage>(m, ros::Time::now()); }, {}, hints);
  const auto left_info = nh.subscribe<sensor_msgs::CameraInfo>(
      topics[2], kQueue,
      [&](const sensor_msgs::CameraInfoConstPtr& m) { input.add<ArrivalLog::kLeftInfo>(m, ros::Time::now()); });
  const auto right_info = nh.subscribe<sensor_msgs::CameraInfo>(
      topics[3], kQueue,
      [&](const sensor_msgs::CameraInfoConstPtr& m) { input.add<ArrivalLog::kRightInfo>(m, ros::Time::now()); });
  const auto transforms = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf", kQueue, [&](const tf2_msgs::TFMessageConstPtr& m) { input.add(*m, false); });
  const auto static_transforms = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf_static", kQueue, [&](const tf2_msgs::TFMessageConstPtr& m) { input.add(*m, true); });
  std::cerr << "Listening to " << topics[0] << " and " << topics[1] << " for " << arguments.seconds
            << " s: hold the camera still, then walk, turn and tilt it." << std::endl;
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(arguments.seconds);
  while (ros::ok() && ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
}

int check(const Arguments& arguments) {
  cv::setNumThreads(1);
  sdvo::CameraCheck check(sdvo::readPipelineOptions(arguments.config, arguments.settings));
  const auto report = [&](sdvo::CameraInput& input) {
    const std::vector<sdvo::Finding> findings =
        check.findings(input.topics(), input.stamps(), input.transform(arguments.base_frame), input.rate());
    bool failed = false;
    for (const sdvo::Finding& finding : findings) {
      failed |= finding.verdict == sdvo::Verdict::kFail;
      std::cout << std::left << std::setw(5) << toString(finding.verdict) << std::setw(14) << finding.step
                << finding.what << (finding.remedy.empty() ? "" : "\n" + std::string(19, ' ') + "-> " + finding.remedy)
                << "\n";
    }
    if (!arguments.page.empty())
      sdvo::writeCheckPage(arguments.page, arguments.topics()[0], findings, check.rows(), check.picture());
    return failed ? 2 : 0;
  };
  if (!arguments.bag.empty()) {
    sdvo::CameraInput input(arguments.topics(), [&](const sdvo::StereoPairMessages& pair) { check.add(pair); });
    readBag(arguments, input);
    return report(input);
  }
  constexpr std::size_t kWaiting = 100;  // pairs
  sdvo::Worker<sdvo::StereoPairMessages> worker(kWaiting,
                                                [&](const sdvo::StereoPairMessages& pair) { check.add(pair); });
  sdvo::CameraInput input(arguments.topics(), [&](const sdvo::StereoPairMessages& pair) { worker.push(pair); });
  listen(arguments, input);
  worker.stop();
  return report(input);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "check_camera", ros::init_options::AnonymousName);  // takes ROS's arguments away
  ros::Time::init();                                                        // for bags, which need no master
  CLI::App app(
      "Checks a rectified stereo camera step by step, live or in a bag: topics, stamps, calibration, images, motion. "
      "Exit code 2: a step FAILs. For 30 s of a camera that is held still, walked, turned and tilted");
  Arguments arguments;
  app.add_option("--bag", arguments.bag, "recorded bag; empty: listen to the topics")->check(CLI::ExistingFile);
  app.add_option("--camera", arguments.camera, "namespace of both sides")->capture_default_str();
  app.add_option("--left", arguments.left, "name of the left side, such as infra1")->capture_default_str();
  app.add_option("--right", arguments.right, "name of the right side")->capture_default_str();
  app.add_option("--image", arguments.image, "name of the rectified images, such as image_rect_raw")
      ->capture_default_str();
  app.add_option("--base-frame", arguments.base_frame, "the robot's frame on TF")->capture_default_str();
  app.add_option("--seconds", arguments.seconds, "how long to listen, s")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  app.add_option("--transport", arguments.transport, "image transport to listen by")->capture_default_str();
  app.add_option("--page", arguments.page, "HTML page with the table, the map of the rows and a pair");
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings, "option as name=value; repeatable")->allow_extra_args(false);
  return sdvo::runTool(app, argc, argv, [&] { return check(arguments); });
}
