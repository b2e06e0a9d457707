#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "../../src/common/progress.hpp"
#include "../../src/tools/run_tool.hpp"
#include "../render/drive_renderer.hpp"
#include "../render/preset_paths.hpp"
#include "../render/rigs.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;
using sdvo::render::DrivePath;
using sdvo::render::DriveRenderer;
using sdvo::render::RenderOptions;
using sdvo::render::Rig;
using sdvo::render::Scenery;

namespace {

struct Request {
  std::string trajectory, output;
  int frames = 0;  ///< 0: all
  int start = 0;
  double rate = 0.0;  ///< Hz; 0: that of the rig
  int threads = 0;    ///< 0: one per processor
  std::string rig = "kitti", world = "auto", calibration, size;
  std::vector<int> truth_frames;
  RenderOptions options;
};

/// A calibration with the size of the images, which it does not tell itself.
sdvo::StereoCamera readCalibration(const std::string& path, const std::string& size) {
  sdvo::StereoCamera camera = sdvo::readKittiCalibration(path, sdvo::KittiCameras::kGrey);
  int consumed = 0;
  if (std::sscanf(size.c_str(), "%dx%d%n", &camera.width, &camera.height, &consumed) != 2 ||
      consumed != static_cast<int>(size.size()))
    throw std::invalid_argument("--calib needs --size such as 1241x376, not '" + size + "'");
  if (camera.width > 8192 || camera.height > 8192) throw std::invalid_argument("--size is limited to 8192x8192");
  camera.check();
  return camera;
}

/// NumPy's array format, version 1: rows x columns (x channels), little endian.
void writeArray(const fs::path& path, const cv::Mat& array) {
  const std::string type = array.depth() == CV_8U ? "|u1" : "<f4";
  std::string shape = std::to_string(array.rows) + ", " + std::to_string(array.cols);
  if (array.channels() > 1) shape += ", " + std::to_string(array.channels());
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::string content = std::string("\x93NUMPY\x01\x00", 8);
  content += static_cast<char>(header.size() & 0xff);
  content += static_cast<char>(header.size() >> 8);
  content += header;
  content.append(array.ptr<char>(), array.total() * array.elemSize());
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error("cannot write file '" + path.string() + "': is the disk full?");
}

/// Renders and writes the frames on several threads; each frame depends on its number alone.
void renderFrames(const DriveRenderer& renderer, const std::vector<int>& frames, const Request& request,
                  const sdvo::KittiWriter& output) {
  const fs::path truth_directory = fs::path(output.path()) / "truth";
  if (!request.truth_frames.empty()) fs::create_directory(truth_directory);
  sdvo::Progress progress("rendering", static_cast<int>(frames.size()));
  std::mutex mutex;
  std::exception_ptr failure;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    try {
      DriveRenderer::Worker worker = renderer.makeWorker();
      for (std::size_t i = next++; i < frames.size(); i = next++) {
        const sdvo::render::StereoPair pair = renderer.render(frames[i], worker);
        output.writeImage(0, static_cast<int>(i), pair.left);
        output.writeImage(1, static_cast<int>(i), pair.right);
        const auto& wanted = request.truth_frames;
        if (std::find(wanted.begin(), wanted.end(), static_cast<int>(i)) != wanted.end()) {
          const sdvo::render::Truth truth = renderer.truth(frames[i], worker);
          const std::string frame = (truth_directory / sdvo::kittiFrameName(static_cast<int>(i))).string();
          writeArray(frame + "_depth.npy", truth.depth);
          writeArray(frame + "_disparity.npy", truth.disparity);
          writeArray(frame + "_flow.npy", truth.flow);
          writeArray(frame + "_moving.npy", truth.moving);
        }
        const std::lock_guard<std::mutex> lock(mutex);
        progress.step();
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
      next = frames.size();
    }
  };
  std::vector<std::thread> pool;
  for (int thread = 0; thread < request.threads; ++thread) pool.emplace_back(work);
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

DrivePath makePath(const Request& request) {
  const std::vector<std::string>& presets = sdvo::render::presetNames();
  if (std::find(presets.begin(), presets.end(), request.trajectory) == presets.end())
    return DrivePath(sdvo::readKittiPoses(request.trajectory), request.rate);
  const int frames = request.frames > 0 ? request.start + request.frames : 0;
  return sdvo::render::makePresetPath(request.trajectory, frames, request.rate,
                                      static_cast<std::uint64_t>(request.options.seed));
}

Scenery chooseScenery(const Request& request, const Rig& rig) {
  static const std::map<std::string, Scenery> names = {{"street", Scenery::kStreet},
                                                       {"room", Scenery::kRoom},
                                                       {"corridor", Scenery::kCorridor},
                                                       {"desk", Scenery::kDesk}};
  if (request.world != "auto") return names.at(request.world);
  return sdvo::render::presetScenery(request.trajectory).value_or(rig.indoors ? Scenery::kRoom : Scenery::kStreet);
}

double seconds(const std::chrono::steady_clock::time_point& since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

int renderDrive(Request request) {
  const Rig& rig = sdvo::render::findRig(request.rig);
  if (request.rate == 0.0) request.rate = rig.rate;
  if (request.threads == 0) request.threads = std::max(1u, std::thread::hardware_concurrency());
  if (request.options.samples != 1 && request.options.samples != 4 && request.options.samples != 16)
    throw std::invalid_argument("--samples must be 1, 4 or 16");
  if (request.calibration.empty() && !request.size.empty())
    throw std::invalid_argument("--size belongs to --calib; a rig preset has its own size");
  const sdvo::StereoCamera camera =
      request.calibration.empty() ? rig.camera : readCalibration(request.calibration, request.size);
  const DrivePath path = makePath(request);
  if (request.start >= path.count())
    throw std::invalid_argument("--start " + std::to_string(request.start) + " is beyond the last pose " +
                                std::to_string(path.count() - 1));
  const int count = request.frames > 0 ? request.frames : path.count() - request.start;
  if (request.start + count > path.count())
    throw std::invalid_argument("--frames " + std::to_string(count) + " from " + std::to_string(request.start) +
                                " is more than the " + std::to_string(path.count()) + " poses of the trajectory");
  const auto checkTruthFrames = [&](int available) {
    for (const int frame : request.truth_frames)
      if (frame < 0 || frame >= available)
        throw std::invalid_argument("--truth-frame " + std::to_string(frame) + " is not one of the " +
                                    std::to_string(available) + " frames written");
  };
  checkTruthFrames(count);

  sdvo::KittiWriter output(request.output);
  cv::setNumThreads(1);  // the frames are the parallel work
  const auto begin = std::chrono::steady_clock::now();
  const DriveRenderer renderer(path, chooseScenery(request, rig), camera, request.options, request.start, count,
                               request.threads);
  std::printf("world: %.1f million surfaces in %.1f s, moving share %.4f\n",
              1e-6 * static_cast<double>(renderer.world().mesh.quads.size()), seconds(begin), renderer.movingShare());
  std::fflush(stdout);

  std::vector<int> frames;
  std::vector<std::int64_t> stamps;
  sdvo::Trajectory poses;
  const Eigen::Isometry3d T_path_left = request.options.mount.T_path_left();
  const Eigen::Isometry3d T_first_world = (path.pose(request.start) * T_path_left).inverse();
  for (int i = 0; i < count; ++i) {
    const int frame = request.start + i;
    if (frame > request.start && renderer.isDropped(frame)) continue;
    frames.push_back(frame);
    stamps.push_back(std::llround(1e9 * i / request.rate));
    poses.push_back(T_first_world * path.pose(frame) * T_path_left);
  }
  checkTruthFrames(static_cast<int>(frames.size()));  // some may have been dropped

  const auto rendering = std::chrono::steady_clock::now();
  const double cpu = cpuSeconds();
  renderFrames(renderer, frames, request, output);
  output.finish(camera, stamps, poses);
  const auto pairs = static_cast<double>(frames.size());
  std::printf("%zu pairs of %dx%d px, %.1f pairs/s, %.2f CPU s per pair\n", frames.size(), camera.width, camera.height,
              pairs / std::max(1e-9, seconds(rendering)), (cpuSeconds() - cpu) / pairs);
  return 0;
}

std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::vector<std::string> rigNames() {
  std::vector<std::string> names;
  for (const Rig& rig : sdvo::render::rigs()) names.push_back(rig.name);
  return names;
}

/// Name, size, focal length and baseline of each rig.
std::string rigsText() {
  std::vector<std::string> texts;
  for (const auto& [name, camera, rate, indoors] : sdvo::render::rigs()) {
    char text[96];
    std::snprintf(text, sizeof text, "%s (%dx%d, f %.4g px, %.2g m)", name.c_str(), camera.width, camera.height,
                  camera.fx, camera.baseline);
    texts.push_back(text);
  }
  return listed(texts);
}

/// One flag per field of the options, with the default, the unit and the range that the struct gives it.
void addOptions(CLI::App& app, RenderOptions& options) {
  for (const sdvo::Option& option : sdvo::listOptions(options)) {
    std::string flag = "--" + option.name;
    std::replace(flag.begin(), flag.end(), '_', '-');
    char range[96];
    std::snprintf(range, sizeof range, " [%.10g … %.10g", option.range.min, option.range.max);
    app.add_option_function<std::string>(
           flag,
           [option, flag](const std::string& text) {
             sdvo::Option target = option;
             try {
               target.name = flag;
               target.set(text);
               target.check();
             } catch (const std::exception& e) {
               throw CLI::ValidationError(e.what(), CLI::ExitCodes::ValidationError);
             }
           },
           option.meaning + range + (option.unit.empty() ? "" : " " + option.unit) + ", default " + option.text() + "]")
        ->type_name("");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Renders a stereo drive of any length with exact ground truth in KITTI layout.");
  Request request;
  app.add_option("--trajectory", request.trajectory, listed(sdvo::render::presetNames()) + ", or a KITTI pose file")
      ->required();
  app.add_option("--output", request.output, "Directory to create")->required();
  app.add_option("--frames", request.frames, "Pairs to render [default: all of the trajectory]")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--start", request.start, "First pose to render [default 0]")->check(CLI::Range(0, 1000000));
  app.add_option("--rate", request.rate, "Pairs per second, Hz [default: the rig's, 10 or indoors 20]")
      ->check(CLI::Range(0.1, 1000.0));
  app.add_option("--threads", request.threads, "Threads; they do not change the result [default: one per processor]")
      ->check(CLI::Range(1, 1024));
  app.add_option("--rig", request.rig, rigsText())->check(CLI::IsMember(rigNames()));
  app.add_option("--calib", request.calibration, "A KITTI calib.txt (P0 and P1) instead of the rig; needs --size");
  app.add_option("--size", request.size, "WxH, image size in px for --calib");
  app.add_option("--world", request.world,
                 "street, room, corridor, desk, or auto: the trajectory's own, else a street for kitti and a room for "
                 "other rigs")
      ->check(CLI::IsMember({"auto", "street", "room", "corridor", "desk"}));
  app.add_option("--truth-frame", request.truth_frames,
                 "Number(s) of written frames whose exact depth, disparity, flow and moving pixels go to truth/*.npy");
  addOptions(app, request.options);
  return sdvo::runTool(app, argc, argv, [&] { return renderDrive(request); });
}
