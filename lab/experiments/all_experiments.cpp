#include "all_experiments.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "child_process.hpp"
#include "experiment_setup.hpp"
#include "plot_script.hpp"

namespace sdvo {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// A program to run and where its output goes.
struct Job {
  std::string log;
  Words command;
};

/// A rendered drive: none of them, nor its seed, served to choose an option.
struct RenderedDrive {
  std::string name, trajectory, start, seed;
  std::string rig = "kitti", rate = "";
};

const std::vector<RenderedDrive>& streets() {
  static const std::vector<RenderedDrive> drives = {
      {"d00", "00", "100", "11"}, {"d01", "01", "400", "18"}, {"d02", "02", "500", "12"}, {"d03", "03", "200", "13"},
      {"d05", "05", "300", "14"}, {"d08", "08", "400", "15"}, {"d09", "09", "200", "16"}, {"d10", "10", "100", "17"}};
  return drives;
}

const std::vector<RenderedDrive>& smallRigs() {
  static const std::vector<RenderedDrive> drives = {{"s1", "hand_held", "0", "71", "d435_small"},
                                                    {"s2", "corridor", "0", "72", "oak_d"},
                                                    {"s3", "desk", "0", "73", "d435"},
                                                    {"s4", "hand_held", "0", "74", "zed_mini"}};
  return drives;
}

/// Approaches with long steps, whose scale changes are large: a street, and a corridor with walls at its turns.
const std::vector<RenderedDrive>& approaches() {
  static const std::vector<RenderedDrive> drives = {{"a1", "straight", "0", "81", "kitti", "10"},
                                                    {"a2", "corridor", "0", "82", "oak_d", "4"},
                                                    {"a3", "corridor", "0", "83", "d435_small", "4"}};
  return drives;
}

/// Runs all jobs, `count` at a time, in their order.
void runJobs(const std::vector<Job>& jobs, int count) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::string failed;
  const auto work = [&] {
    for (std::size_t i = next++; i < jobs.size(); i = next++) {
      const int code = runProgram(jobs[i].command, jobs[i].log);
      const std::lock_guard<std::mutex> lock(mutex);
      std::cerr << (code == 0 ? "done: " : "FAILED: ") << jobs[i].log << std::endl;
      if (code != 0) failed = jobs[i].log;
    }
  };
  std::vector<std::thread> pool;
  for (int k = 0; k < count; ++k) pool.emplace_back(work);
  for (std::thread& thread : pool) thread.join();
  if (!failed.empty()) throw std::runtime_error("an experiment failed, see " + failed);
}

std::string joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
  return text;
}

class Plan {
 public:
  explicit Plan(const AllExperiments& all) : all_(all), output_(all.output), drives_(output_ / "drives") {}

  /// Of the drives that are not there.
  std::vector<Job> drives() const {
    fs::create_directories(drives_);
    std::vector<Job> jobs;
    for (const auto* group : {&streets(), &smallRigs(), &approaches()})
      for (const RenderedDrive& drive : *group) {
        const fs::path directory = drives_ / drive.name;
        if (fs::exists(directory / "poses.txt")) continue;
        const bool preset = !std::all_of(drive.trajectory.begin(), drive.trajectory.end(), ::isdigit);
        const std::string trajectory = preset ? drive.trajectory : all_.kitti + "/poses/" + drive.trajectory + ".txt";
        Words command = {tool("render_drive"),
                         "--trajectory",
                         trajectory,
                         "--start",
                         drive.start,
                         "--frames",
                         "31",
                         "--seed",
                         drive.seed,
                         "--rig",
                         drive.rig,
                         "--noise",
                         "2",
                         "--exposure",
                         "0.3",
                         "--threads",
                         "1",
                         "--output",
                         directory.string()};
        if (!preset) command.insert(command.end(), {"--moving-share", "0.02"});
        if (!drive.rate.empty()) command.insert(command.end(), {"--rate", drive.rate});
        jobs.push_back({directory.string() + ".log", command});
      }
    if (!all_.euroc.empty() && !fs::exists(moving() / "poses.txt"))
      jobs.push_back(
          {moving().string() + ".log",
           {tool("euroc_to_kitti"), "--input", all_.euroc + "/MH_01_moving/mav0", "--output", moving().string()}});
    return jobs;
  }

  /// Those of `only`, or all.
  std::vector<Job> experiments() const {
    std::vector<Job> jobs;
    const auto wanted = [&](const std::string& name) { return all_.only.empty() || all_.only == name; };
    const std::vector<std::string>& setups = namesOf(Setup{});
    if (wanted("matching"))
      for (const std::string& setup : setups)
        jobs.push_back(matching(setup, setup, everyDrive(), "21",
                                {"--descriptors", "freak", "--features", "310,1350,2320", "--constant-sizes", "14"}));
    if (wanted("ablation")) addAblations(jobs);
    for (const std::string& setup : setups) {
      if (wanted("robustness")) jobs.push_back(run("robustness", setup, setup, everyDrive(), "11", {"--stride", "5"}));
      if (wanted("sift"))
        jobs.push_back(matching(setup, setup + "/sift", everyDrive(), "11",
                                {"--descriptors", "sift", "--features", "2320", "--layouts", "left", "--tolerances",
                                 "3", "--constant-sizes", "5"}));
    }
    if (wanted("scale_change"))
      jobs.push_back(run("scale_change", "product", "scale_change", withScaleChange(), "31", {}));
    if (wanted("consensus"))
      jobs.push_back(
          {log("consensus", "consensus"),
           {tool("run_experiments"), "consensus", "--seeds", "100", "--output", (output_ / "consensus").string()}});
    if (wanted("accuracy"))
      for (const std::string& setup : setups)
        jobs.push_back(run("accuracy", setup, setup, drivesWithTrueLengths(), "11", {"--features", "400"}));
    return jobs;
  }

 private:
  static std::string tool(const std::string& name) { return (programFolder() / name).string(); }
  fs::path moving() const { return drives_ / "MH_01_moving"; }

  std::string log(const std::string& folder, const std::string& experiment) const {
    fs::create_directories(output_ / folder);
    return (output_ / folder / (experiment + ".log")).string();
  }

  Words rendered() const {
    Words drives;
    for (const auto* group : {&streets(), &smallRigs()})
      for (const RenderedDrive& drive : *group) drives.push_back((drives_ / drive.name).string());
    return drives;
  }

  Words everyDrive() const {
    Words drives = {"01", "04", "06"};
    if (!all_.karlsruhe.empty()) drives.push_back(all_.karlsruhe + "/sequences/19");
    return withEurocAndRendered(drives);
  }

  /// The ground truth of KITTI 01 and of Karlsruhe 19 has lengths that are wrong by several per cent.
  Words drivesWithTrueLengths() const { return withEurocAndRendered({"04", "06"}); }

  Words withEurocAndRendered(Words drives) const {
    if (!all_.euroc.empty()) drives.insert(drives.end(), {all_.euroc + "/MH_01_half", moving().string()});
    const Words more = rendered();
    drives.insert(drives.end(), more.begin(), more.end());
    return drives;
  }

  /// Two real drives, two streets, and the approaches.
  Words withScaleChange() const {
    Words drives = {"04", "06"};
    for (const char* street : {"d00", "d05"}) drives.push_back((drives_ / street).string());
    for (const RenderedDrive& drive : approaches()) drives.push_back((drives_ / drive.name).string());
    return drives;
  }

  Job run(const std::string& experiment, const std::string& setup, const std::string& folder, const Words& drives,
          const std::string& frames, const Words& options) const {
    Words command = {
        tool("run_experiments"), experiment,     "--setup",  setup,  "--kitti",  all_.kitti,
        "--sequences",           joined(drives), "--frames", frames, "--output", (output_ / folder).string()};
    command.insert(command.end(), options.begin(), options.end());
    return {log(folder, experiment), command};
  }

  Job matching(const std::string& setup, const std::string& folder, const Words& drives, const std::string& frames,
               const Words& options) const {
    return run("matching", setup, folder, drives, frames, options);
  }

  void addAblations(std::vector<Job>& jobs) const {
    const std::vector<std::string>& setups = namesOf(Setup{});
    for (const std::string& setup : setups) jobs.push_back(ablation(setup, "as it is", {}));
    for (const SetupDifference& difference : paperDifferences()) {
      jobs.push_back(ablation("product", "with " + difference.name, difference.with));
      jobs.push_back(ablation("paper", "without " + difference.name, difference.without));
    }
    for (const SetupDifference& difference : otherDifferences())
      for (const std::string& setup : setups)
        jobs.push_back(ablation(setup, "with " + difference.name, difference.with));
  }

  Job ablation(const std::string& setup, const std::string& name, const Words& settings) const {
    Words options = {"--descriptors",    "freak", "--features", "2320", "--layouts", "left",
                     "--constant-sizes", "14",    "--no-plot"};
    for (const std::string& setting : settings) options.insert(options.end(), {"--param", setting});
    return matching(setup, "ablation/" + setup + " " + name, {"01", "04", "06"}, "11", options);
  }

  const AllExperiments& all_;
  fs::path output_, drives_;
};

}  // namespace

const std::vector<std::string>& experimentNames() {
  static const std::vector<std::string> names = {"matching",     "ablation",  "robustness", "sift",
                                                 "scale_change", "consensus", "accuracy"};
  return names;
}

std::string runAll(const AllExperiments& all) {
  const Plan plan(all);
  runJobs(plan.drives(), all.jobs);
  runJobs(plan.experiments(), all.jobs);
  if (all.only.empty() || all.only == "scale_change")
    runPlotScript("plot_experiments.py", {"scale_change", all.output + "/scale_change"});
  const std::string tables = all.output + "/tables.md";
  runPlotScript("experiment_tables.py", {all.output, "--output", tables});
  std::ifstream file(tables);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace sdvo
