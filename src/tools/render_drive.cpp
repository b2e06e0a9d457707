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
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "../common/progress.hpp"
#include "../data/text_file.hpp"
#include "../render/drive_renderer.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;
using sdvo::render::DrivePath;
using sdvo::render::DriveRenderer;
using sdvo::render::RenderOptions;

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

/// The pair P0, P1 of a KITTI calib.txt.
sdvo::StereoCamera readCalibration(const std::string& path, const std::string& size) {
  std::ifstream file = sdvo::openTextFile(path);
  std::optional<std::vector<double>> P[2];
  for (std::string line; std::getline(file, line);) {
    const std::vector<std::string> words = sdvo::splitWords(line);
    if (words.size() != 13 || (words[0] != "P0:" && words[0] != "P1:")) continue;
    std::vector<double> values;
    for (std::size_t i = 1; i < words.size(); ++i) values.push_back(sdvo::parseNumber<double>(words[i]));
    P[words[0] == "P0:" ? 0 : 1] = values;
  }
  if (!P[0] || !P[1]) throw std::runtime_error("file '" + path + "' needs a line 'P0:' and a line 'P1:' of 12 numbers");
  sdvo::StereoCamera camera;
  camera.fx = (*P[0])[0];
  camera.fy = (*P[0])[5];
  camera.cx = (*P[0])[2];
  camera.cy = (*P[0])[6];
  camera.baseline = -(*P[1])[3] / camera.fx;
  int consumed = 0;
  if (std::sscanf(size.c_str(), "%dx%d%n", &camera.width, &camera.height, &consumed) != 2 ||
      consumed != static_cast<int>(size.size()))
    throw std::invalid_argument("--calib needs --size such as 1241x376, not '" + size + "'");
  if (camera.width > 8192 || camera.height > 8192) throw std::invalid_argument("--size is limited to 8192x8192");
  camera.check();
  return camera;
}

std::string calibrationText(const sdvo::StereoCamera& camera) {
  char text[1024];
  std::string lines;
  for (int side = 0; side < 2; ++side) {
    std::snprintf(text, sizeof text, "P%d: %.12e 0 %.12e %.12e 0 %.12e %.12e 0 0 0 1 0\n", side, camera.fx, camera.cx,
                  side == 0 ? 0.0 : -camera.fx * camera.baseline, camera.fy, camera.cy);
    lines += text;
  }
  return lines;
}

void writeFile(const fs::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error("cannot write file '" + path.string() + "': is the disk full?");
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
  writeFile(path, content);
}

std::string frameName(int number) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d", number);
  return name;
}

void writeImage(const fs::path& path, const cv::Mat& image) {
  // OpenCV's own settings are its fastest, one filter and run lengths; naming a level makes it try all filters.
  if (!cv::imwrite(path.string(), image))
    throw std::runtime_error("cannot write image '" + path.string() + "': is the disk full?");
}

/// Creates the directories; whatever is in an existing one must not be mixed with the new drive.
void prepareOutput(const fs::path& directory, bool truth) {
  std::error_code error;
  if (fs::exists(directory) && !(fs::is_directory(directory) && fs::is_empty(directory)))
    throw std::runtime_error("--output '" + directory.string() +
                             "' exists and is not empty: remove it or choose another");
  for (const char* name : {"image_0", "image_1"}) fs::create_directories(directory / name, error);
  if (truth) fs::create_directories(directory / "truth", error);
  if (error) throw std::runtime_error("cannot create --output '" + directory.string() + "': " + error.message());
}

/// Renders and writes the frames on several threads; each frame depends on its number alone.
void renderFrames(const DriveRenderer& renderer, const std::vector<int>& frames, const Request& request) {
  const fs::path output = request.output;
  sdvo::Progress progress("rendering", static_cast<int>(frames.size()));
  std::mutex mutex;
  std::exception_ptr failure;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    try {
      DriveRenderer::Worker worker = renderer.makeWorker();
      for (std::size_t i = next++; i < frames.size(); i = next++) {
        const sdvo::render::StereoPair pair = renderer.render(frames[i], worker);
        const std::string name = frameName(static_cast<int>(i));
        writeImage(output / "image_0" / (name + ".png"), pair.left);
        writeImage(output / "image_1" / (name + ".png"), pair.right);
        const auto& wanted = request.truth_frames;
        if (std::find(wanted.begin(), wanted.end(), static_cast<int>(i)) != wanted.end()) {
          const sdvo::render::Truth truth = renderer.truth(frames[i], worker);
          writeArray(output / "truth" / (name + "_depth.npy"), truth.depth);
          writeArray(output / "truth" / (name + "_disparity.npy"), truth.disparity);
          writeArray(output / "truth" / (name + "_flow.npy"), truth.flow);
          writeArray(output / "truth" / (name + "_moving.npy"), truth.moving);
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

double seconds(const std::chrono::steady_clock::time_point& since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

double cpuSeconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

int renderDrive(Request request) {
  const bool euroc = request.rig == "euroc";
  if (request.rate == 0.0) request.rate = euroc ? 20.0 : 10.0;
  if (request.threads == 0) request.threads = std::max(1u, std::thread::hardware_concurrency());
  if (request.options.samples != 1 && request.options.samples != 4 && request.options.samples != 16)
    throw std::invalid_argument("--samples must be 1, 4 or 16");
  if (request.calibration.empty() && !request.size.empty())
    throw std::invalid_argument("--size belongs to --calib; a rig preset has its own size");
  const sdvo::StereoCamera camera = !request.calibration.empty() ? readCalibration(request.calibration, request.size)
                                    : euroc                      ? sdvo::render::eurocCamera()
                                                                 : sdvo::render::kittiCamera();
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
  const bool room = request.world == "room" || (request.world == "auto" && (euroc || request.trajectory == "hover"));

  prepareOutput(request.output, !request.truth_frames.empty());
  cv::setNumThreads(1);  // the frames are the parallel work
  const auto begin = std::chrono::steady_clock::now();
  const DriveRenderer renderer(path, room ? DriveRenderer::Scenery::kRoom : DriveRenderer::Scenery::kStreet, camera,
                               request.options, request.start, count, request.threads);
  std::printf("world: %.1f million surfaces in %.1f s, moving share %.4f\n",
              1e-6 * static_cast<double>(renderer.world().mesh.quads.size()), seconds(begin), renderer.movingShare());
  std::fflush(stdout);

  std::vector<int> frames;
  std::string times;
  sdvo::Trajectory poses;
  const Eigen::Isometry3d T_first_world = path.pose(request.start).inverse();
  for (int i = 0; i < count; ++i) {
    const int frame = request.start + i;
    if (frame > request.start && renderer.isDropped(frame)) continue;
    frames.push_back(frame);
    times += sdvo::formatSeconds(std::llround(1e9 * i / request.rate)) + "\n";
    poses.push_back(T_first_world * path.pose(frame));
  }
  checkTruthFrames(static_cast<int>(frames.size()));  // some may have been dropped

  const auto rendering = std::chrono::steady_clock::now();
  const double cpu = cpuSeconds();
  renderFrames(renderer, frames, request);
  // Last: a directory without them is recognised as incomplete.
  const fs::path output = request.output;
  writeFile(output / "calib.txt", calibrationText(camera));
  writeFile(output / "times.txt", times);
  sdvo::writeKittiPoses((output / "poses.txt").string(), poses);
  const auto pairs = static_cast<double>(frames.size());
  std::printf("%zu pairs of %dx%d px, %.1f pairs/s, %.2f CPU s per pair\n", frames.size(), camera.width, camera.height,
              pairs / std::max(1e-9, seconds(rendering)), (cpuSeconds() - cpu) / pairs);
  return 0;
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
  app.add_option("--trajectory", request.trajectory,
                 "straight, figure_eight, city_loop, hover, still, or a KITTI pose file")
      ->required();
  app.add_option("--output", request.output, "Directory to create")->required();
  app.add_option("--frames", request.frames, "Pairs to render [default: all of the trajectory]")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--start", request.start, "First pose to render [default 0]")->check(CLI::Range(0, 1000000));
  app.add_option("--rate", request.rate, "Pairs per second, Hz [default: 10, with --rig euroc 20]")
      ->check(CLI::Range(0.1, 1000.0));
  app.add_option("--threads", request.threads, "Threads; they do not change the result [default: one per processor]")
      ->check(CLI::Range(1, 1024));
  app.add_option("--rig", request.rig,
                 "kitti (1241x376, f 707 px, 0.54 m) or euroc (752x480, f 436 px, 0.11 m, indoors)")
      ->check(CLI::IsMember({"kitti", "euroc"}));
  app.add_option("--calib", request.calibration, "A KITTI calib.txt (P0 and P1) instead of the rig; needs --size");
  app.add_option("--size", request.size, "WxH, image size in px for --calib");
  app.add_option("--world", request.world, "street, room, or auto: a room for --rig euroc and hover")
      ->check(CLI::IsMember({"auto", "street", "room"}));
  app.add_option("--truth-frame", request.truth_frames,
                 "Number(s) of written frames whose exact depth, disparity, flow and moving pixels go to truth/*.npy");
  addOptions(app, request.options);
  return sdvo::runTool(app, argc, argv, [&] { return renderDrive(request); });
}
