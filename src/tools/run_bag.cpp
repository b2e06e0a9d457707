// Runs the odometry on recorded bags without a ROS master: the same core as the nodelets, every pair processed.
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <map>
#include <opencv2/core/utility.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"
#include "bag_run.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace {

struct Arguments {
  std::vector<std::string> inputs, settings;
  std::string output, config, format = "tum", camera = "/stereo";
  int jobs = 1, threads = 1;
  bool resume = false, shuttle = false, halves = false;
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

/// `output`: the folder of the results with the bag's name.
fs::path selfCheckFile(const fs::path& output) {
  return output.string() + ".self_check.csv";
}

/// Writes NAME.self_check.csv and says the same in sentences.
void checkItself(const sdvo::BagRun& bag, const fs::path& output, const Arguments& arguments) {
  std::vector<sdvo::SelfCheck> checks;
  if (arguments.shuttle) checks.push_back(bag.shuttle());
  if (arguments.halves) checks.push_back(bag.halves());
  if (checks.empty()) return;
  std::ofstream file(selfCheckFile(output));
  file << sdvo::SelfCheck::columns() << "\n";
  for (const sdvo::SelfCheck& check : checks) {
    file << check.row() << "\n";
    std::cout << output.filename().string() + ": " + check.text() + "\n" << std::flush;
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + selfCheckFile(output).string());
}

Row runBag(const fs::path& bag, const fs::path& output, const Arguments& arguments) {
  sdvo::PipelineOptions options = sdvo::readPipelineOptions(arguments.config, arguments.settings);
  cv::setNumThreads(arguments.threads);
  const sdvo::BagRun of_bag(bag.string(), arguments.camera, options, arguments.halves);
  const sdvo::OfflineRun& run = of_bag.whole();
  if (arguments.format == "kitti")
    sdvo::writeKittiPoses(output.string() + ".txt", run.poses());
  else
    sdvo::writeTumPoses(output.string() + ".txt", run.stampedPoses());
  run.writeTiming(output.string() + ".csv");
  checkItself(of_bag, output, arguments);
  std::ostringstream figures;
  figures << std::fixed << std::setprecision(1) << run.pairs() << "," << run.pairsWithoutPose() << ","
          << run.discontinuities() << "," << of_bag.leftOut() << "," << run.distance() << "," << run.time(0.5) << ","
          << run.time(0.95) << "," << run.cpuTime() << "," << sdvo::hashOptions(sdvo::listOptions(options));
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

/// Whether the self-checks that are asked for are among the bag's results.
bool hasSelfChecks(const std::string& name, const Arguments& arguments) {
  std::ifstream file(selfCheckFile(fs::path(arguments.output) / name));
  const std::string lines((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return (!arguments.shuttle || lines.find("\nshuttle,") != std::string::npos) &&
         (!arguments.halves || lines.find("\nhalves,") != std::string::npos);
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
    if (arguments.resume && isFinished(readRow(arguments.output, name)) && hasSelfChecks(name, arguments)) continue;
    fs::remove(rowFile(arguments.output, name));
    fs::remove(selfCheckFile(fs::path(arguments.output) / name));
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
  app.add_flag("--shuttle", arguments.shuttle,
               "plays each bag backwards, too: NAME.self_check.csv says how far from its start it ends");
  app.add_flag("--halves", arguments.halves,
               "runs on two halves of the features, too: NAME.self_check.csv says how far they differ");
  app.add_option("--config", arguments.config, "YAML file as the nodelets load it");
  app.add_option("--param", arguments.settings,
                 "option as name=value, for example detector/max_features=800; repeatable")
      ->allow_extra_args(false);
  app.add_option("--threads", arguments.threads, "threads of OpenCV")->capture_default_str()->check(CLI::Range(1, 256));
  return sdvo::runTool(app, argc, argv, [&] { return runAll(arguments); });
}
