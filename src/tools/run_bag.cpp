// Runs the odometry on recorded bags without a ROS master: the same core as the nodelets, every pair processed.
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <map>
#include <opencv2/core/utility.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"
#include "../ros/pair_decoder.hpp"
#include "../ros/stamp_filter.hpp"
#include "../ros/stamps.hpp"
#include "offline_run.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace {

struct Arguments {
  std::vector<std::string> inputs, settings;
  std::string output, config, format = "tum", camera = "/stereo";
  int jobs = 1, threads = 1;
  bool resume = false;
};

const char kColumns[] =
    "bag,pairs,without_pose,discontinuities,left_out,distance_m,median_ms,p95_ms,cpu_ms,options,problem";

/// What became of a bag, as a row of the report. The problem stands last, for it may hold commas.
struct Row {
  std::string figures, problem;

  std::string text(const std::string& bag) const {
    return bag + "," + (figures.empty() ? ",,,,,,,," : figures) + "," + problem;
  }
};

/// A message of the type that its topic must have.
template <class Message>
typename Message::ConstPtr instantiate(const rosbag::MessageInstance& instance) {
  const typename Message::ConstPtr message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error(instance.getTopic() + " holds " + instance.getDataType() + ", expected " +
                             ros::message_traits::datatype<Message>());
  return message;
}

/// What of a bag's messages made no pair.
struct LeftOver {
  int stamps = 0;  ///< that are not on all four topics, or cannot be used
  std::string problem;
};

/// Calls `use(pair, time of arrival)` for each four messages of one stamp, in the order in which they are complete.
template <class Use>
LeftOver forEachPair(const std::string& path, const std::string& camera, const Use& use) {
  constexpr std::size_t kWaiting = 100;  // stamps, of which none may ever be complete: images take memory
  const std::array<std::string, 4> topics = {camera + "/left/image_rect", camera + "/right/image_rect",
                                             camera + "/left/camera_info", camera + "/right/camera_info"};
  const rosbag::Bag bag(path, rosbag::bagmode::Read);
  rosbag::View view(bag, rosbag::TopicQuery(std::vector<std::string>(topics.begin(), topics.end())));
  std::set<std::string> recorded;
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) recorded.insert(connection->topic);
  for (const std::string& topic : topics)
    if (recorded.count(topic) == 0) throw std::runtime_error("there is no " + topic + " in it");

  std::map<ros::Time, sdvo::StereoPairMessages> waiting;
  LeftOver left_over{0, "no four stamps agree"};
  for (const rosbag::MessageInstance& instance : view) {
    const bool is_image = instance.getTopic() == topics[0] || instance.getTopic() == topics[1];
    const bool is_left = instance.getTopic() == topics[0] || instance.getTopic() == topics[2];
    const auto image = is_image ? instantiate<sensor_msgs::Image>(instance) : nullptr;
    const auto info = is_image ? nullptr : instantiate<sensor_msgs::CameraInfo>(instance);
    const ros::Time stamp = is_image ? image->header.stamp : info->header.stamp;
    if (const std::string problem = sdvo::whyUnusable(stamp); !problem.empty()) {
      ++left_over.stamps;
      left_over.problem = instance.getTopic() + ": " + problem;
      continue;
    }
    sdvo::StereoPairMessages& pair = waiting[stamp];
    if (is_image)
      (is_left ? pair.left_image : pair.right_image) = image;
    else
      (is_left ? pair.left_info : pair.right_info) = info;
    if (pair.left_image && pair.right_image && pair.left_info && pair.right_info) {
      use(pair, instance.getTime());
      const auto end = std::next(waiting.find(stamp));
      left_over.stamps += static_cast<int>(std::distance(waiting.begin(), end)) - 1;
      waiting.erase(waiting.begin(), end);
    } else if (waiting.size() > kWaiting) {
      ++left_over.stamps;
      waiting.erase(waiting.begin());
    }
  }
  left_over.stamps += static_cast<int>(waiting.size());
  return left_over;
}

Row runBag(const fs::path& bag, const fs::path& output, const Arguments& arguments) {
  sdvo::PipelineOptions options = sdvo::readPipelineOptions(arguments.config, arguments.settings);
  cv::setNumThreads(arguments.threads);
  sdvo::OfflineRun run(options);
  sdvo::PairDecoder decoder;
  sdvo::StampFilter<sdvo::StereoPairMessages> filter;
  int refused = 0;
  std::string refusal;
  const auto process = [&](const sdvo::StereoPairMessages& pair) {
    try {
      const sdvo::DecodedPair decoded = decoder.decode(pair);
      run.process(decoded.camera, decoded.left, decoded.right, sdvo::nanoseconds(pair.left_image->header.stamp));
      decoder.accept(decoded.camera);
    } catch (const std::invalid_argument& e) {
      ++refused;
      refusal = e.what();
    }
  };
  const LeftOver left_over =
      forEachPair(bag.string(), arguments.camera, [&](const auto& pair, const ros::Time& arrival) {
        const ros::Time stamp = pair.left_image->header.stamp;
        for (const auto& passed : filter.add(pair, sdvo::nanoseconds(stamp), sdvo::nanoseconds(arrival))) {
          if (passed.source_restarts > 0)
            throw std::runtime_error(
                "stamps jump back for good: these are several recordings, one bag for each is needed");
          process(passed.item);
        }
      });
  if (run.pairs() == 0)
    throw std::runtime_error("no pair can be used: " + (refusal.empty() ? left_over.problem : refusal));

  if (arguments.format == "kitti")
    sdvo::writeKittiPoses(output.string() + ".txt", run.poses());
  else
    sdvo::writeTumPoses(output.string() + ".txt", run.stampedPoses());
  run.writeTiming(output.string() + ".csv");
  std::ostringstream figures;
  figures << std::fixed << std::setprecision(1) << run.pairs() << "," << run.pairsWithoutPose() << ","
          << run.discontinuities() << "," << left_over.stamps + refused + static_cast<int>(filter.dropped()) << ","
          << run.distance() << "," << run.time(0.5) << "," << run.time(0.95) << "," << run.cpuTime() << ","
          << sdvo::hashOptions(sdvo::listOptions(options));
  return {figures.str(), ""};
}

fs::path rowFile(const fs::path& output, const std::string& name) {
  return output / (name + ".row");
}

/// Only a row that is whole has its name, so it tells that the bag is finished.
void writeRow(const fs::path& output, const std::string& name, const Row& row) {
  const fs::path partial = rowFile(output, name).string() + ".part";
  std::ofstream file(partial);
  file << row.text(name) << "\n";
  file.close();
  if (!file) throw std::runtime_error("cannot write " + partial.string());
  fs::rename(partial, rowFile(output, name));
}

/// The row of a bag; empty when there is none.
std::string readRow(const fs::path& output, const std::string& name) {
  std::ifstream file(rowFile(output, name));
  std::string row;
  std::getline(file, row);
  return row;
}

bool isFinished(const std::string& row) {
  return !row.empty() && row.back() == ',';
}

/// In a process of its own: a bag that ends it is no harm to the others.
pid_t start(const fs::path& bag, const std::string& name, const Arguments& arguments) {
  std::cout.flush();
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("cannot start a process: ") + std::strerror(errno));
  if (child > 0) return child;
  int failed = 0;
  try {
    Row row;
    try {
      row = runBag(bag, fs::path(arguments.output) / name, arguments);
    } catch (const std::exception& e) {
      row.problem = e.what();
      std::replace(row.problem.begin(), row.problem.end(), '\n', ' ');
    }
    writeRow(arguments.output, name, row);
  } catch (const std::exception& e) {
    std::cerr << "error: " << e.what() << std::endl;
    failed = 1;
  }
  _exit(failed);
}

/// Waits for one of the bags at work and notes why its process did not end by itself.
void finishOne(std::map<pid_t, std::string>& at_work, const Arguments& arguments) {
  int status = 0;
  const pid_t child = wait(&status);
  if (child < 0) throw std::runtime_error(std::string("lost a process: ") + std::strerror(errno));
  const std::string name = at_work.at(child);
  at_work.erase(child);
  if (WIFSIGNALED(status))
    writeRow(arguments.output, name, {"", "ended by " + std::string(strsignal(WTERMSIG(status)))});
  std::cerr << name << ": " << (isFinished(readRow(arguments.output, name)) ? "done" : "failed") << std::endl;
}

/// The bags by name, which their files without ".bag" have.
std::map<std::string, fs::path> findBags(const std::vector<std::string>& inputs) {
  std::map<std::string, fs::path> bags;
  const auto add = [&bags](const fs::path& bag) {
    if (!bags.emplace(bag.stem().string(), bag).second)
      throw std::runtime_error("two bags are called " + bag.filename().string() + ", and so would be their results");
  };
  for (const std::string& input : inputs) {
    if (fs::is_directory(input)) {
      for (const fs::directory_entry& entry : fs::directory_iterator(input))
        if (entry.path().extension() == ".bag") add(entry.path());
    } else if (fs::exists(input)) {
      add(input);
    } else {
      throw std::runtime_error("there is no '" + input + "'");
    }
  }
  if (bags.empty()) throw std::runtime_error("there is no bag in '" + inputs.front() + "'");
  return bags;
}

int runAll(const Arguments& arguments) {
  const std::map<std::string, fs::path> bags = findBags(arguments.inputs);
  sdvo::readPipelineOptions(arguments.config, arguments.settings);  // what is wrong with them is no bag's fault
  fs::create_directories(arguments.output);
  std::map<pid_t, std::string> at_work;
  for (const auto& [name, bag] : bags) {
    if (arguments.resume && isFinished(readRow(arguments.output, name))) continue;
    fs::remove(rowFile(arguments.output, name));
    while (static_cast<int>(at_work.size()) >= arguments.jobs) finishOne(at_work, arguments);
    at_work[start(bag, name, arguments)] = name;
  }
  while (!at_work.empty()) finishOne(at_work, arguments);

  std::ostringstream report;
  report << kColumns << "\n";
  int failed = 0;
  for (const auto& [name, bag] : bags) {
    const std::string row = readRow(arguments.output, name);
    report << row << "\n";
    failed += isFinished(row) ? 0 : 1;
  }
  std::ofstream file(fs::path(arguments.output) / "report.csv");
  file << report.str();
  if (!file.flush()) throw std::runtime_error("cannot write report.csv in " + arguments.output);
  std::cout << report.str();
  if (failed > 0)
    throw std::runtime_error(std::to_string(failed) + " of " + std::to_string(bags.size()) +
                             " bags failed, see the report");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Stereo odometry of bags of rectified images, every pair. For NAME.bag the folder of results gets NAME.txt "
      "(poses "
      "of the left camera) and NAME.csv (a line for each pair); report.csv has a line for each bag");
  Arguments arguments;
  app.add_option("bags", arguments.inputs, "bags, or folders of bags")->required();
  app.add_option("--output", arguments.output, "folder of the results, made where it is missing")->required();
  app.add_option("--camera", arguments.camera, "namespace of left|right/image_rect and camera_info")
      ->capture_default_str();
  app.add_option("--format", arguments.format, "of the poses: tum (those there are) or kitti (a line for each pair)")
      ->capture_default_str()
      ->check(CLI::IsMember({"tum", "kitti"}));
  app.add_option("--jobs", arguments.jobs, "bags at a time")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_flag("--resume", arguments.resume, "leave bags alone whose results are there");
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings,
                 "option as name=value, for example detector/max_features=800; repeatable")
      ->allow_extra_args(false);
  app.add_option("--threads", arguments.threads, "threads of OpenCV")->capture_default_str()->check(CLI::Range(1, 256));
  return sdvo::runTool(app, argc, argv, [&] { return runAll(arguments); });
}
