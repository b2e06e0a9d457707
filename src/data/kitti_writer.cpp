#include "stereo_descriptor_vo/data/kitti_writer.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <system_error>

#include "kitti_layout.hpp"
#include "text_file.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

void writeText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write file '" + path.string() + "': is the disk full?");
}

/// P0 and P1: equal pinhole cameras, the right one's offset is -fx * baseline.
std::string calibrationText(const StereoCamera& camera) {
  std::string text;
  for (int side = 0; side < 2; ++side) {
    const double offset = side == 0 ? 0.0 : -camera.fx * camera.baseline;
    text += "P" + std::to_string(side) + ":";
    for (const double element :
         {camera.fx, 0.0, camera.cx, offset, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0}) {
      char number[32];
      std::snprintf(number, sizeof number, " %.12e", element);
      text += number;
    }
    text += "\n";
  }
  return text;
}

}  // namespace

KittiWriter::KittiWriter(const std::string& directory) {
  fs::path path = fs::absolute(directory).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  final_ = path.string();
  partial_ = final_ + ".part";
  if (fs::exists(path) && !(fs::is_directory(path) && fs::is_empty(path)))
    throw std::runtime_error("output '" + directory + "' exists and is not empty: remove it or choose another");
  if (fs::exists(partial_)) throw std::runtime_error("'" + partial_ + "' is left from an interrupted run: remove it");
  std::error_code error;
  fs::create_directories(partial_, error);
  for (const char* name : {"image_0", "image_1"})
    if (!error) fs::create_directory(fs::path(partial_) / name, error);
  if (error) throw std::runtime_error("cannot create output '" + directory + "': " + error.message());
}

KittiWriter::~KittiWriter() {
  std::error_code ignored;
  if (!finished_) fs::remove_all(partial_, ignored);
}

void KittiWriter::writeImage(int side, int i, const cv::Mat& image) const {
  const fs::path path = fs::path(partial_) / ("image_" + std::to_string(side)) / (kittiFrameName(i) + ".png");
  // OpenCV's own settings are its fastest, one filter and run lengths; naming a level makes it try all filters.
  if (!cv::imwrite(path.string(), image))
    throw std::runtime_error("cannot write image '" + path.string() + "': is the disk full?");
}

void KittiWriter::finish(const StereoCamera& camera, const std::vector<std::int64_t>& stamps, const Trajectory& poses) {
  if (!poses.empty() && poses.size() != stamps.size())
    throw std::invalid_argument("a sequence of " + std::to_string(stamps.size()) + " pairs has " +
                                std::to_string(poses.size()) + " poses");
  const fs::path partial = partial_;
  writeText(partial / "calib.txt", calibrationText(camera));
  std::string times;
  for (const std::int64_t stamp : stamps) times += formatSeconds(stamp) + "\n";
  writeText(partial / "times.txt", times);
  if (!poses.empty()) writeKittiPoses((partial / "poses.txt").string(), poses);
  std::error_code error;
  fs::rename(partial, final_, error);
  if (error) throw std::runtime_error("cannot rename '" + partial_ + "' to '" + final_ + "': " + error.message());
  finished_ = true;
}

}  // namespace sdvo
