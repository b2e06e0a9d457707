#include "euroc_dataset.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <opencv2/core/eigen.hpp>
#include <stdexcept>

#include "image_file.hpp"
#include "text_file.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

/// Paths of a camera's images by stamp in ns.
std::map<std::int64_t, std::string> listImages(const fs::path& directory) {
  std::map<std::int64_t, std::string> files;
  const std::string list = (directory / "data.csv").string();
  readLines(list, false, [&](const std::string& line) {
    const std::size_t comma = line.find(',');
    if (comma == std::string::npos) throw std::invalid_argument("expected 'stamp,file name'");
    const std::size_t name = line.find_first_not_of(' ', comma + 1);
    if (name == std::string::npos) throw std::invalid_argument("the file name is missing");
    files[parseNanoseconds(line.substr(0, comma))] = (directory / "data" / line.substr(name)).string();
  });
  if (files.empty()) throw std::runtime_error("file '" + list + "' lists no images");
  return files;
}

/// Calibration files of the data set: EuRoC has them beside the images, TUM-VI beside mav0.
std::vector<std::string> calibrationFiles(const fs::path& mav0) {
  const fs::path left = mav0 / "cam0" / "sensor.yaml", right = mav0 / "cam1" / "sensor.yaml";
  const fs::path chain = fs::absolute(mav0).lexically_normal().parent_path() / "dso" / "camchain.yaml";
  if (!fs::exists(left) && fs::exists(chain)) return {chain.string()};
  return {left.string(), right.string()};
}

cv::Size sizeOfImages(const fs::path& mav0) {
  return readGreyImage(listImages(mav0 / "cam0").begin()->second).size();
}

}  // namespace

EurocSequence::EurocSequence(const std::string& mav0, const std::vector<std::string>& calibration, double fov)
    : directory_(mav0),
      rectification_(calibration.empty() ? readCalibration(calibrationFiles(mav0), fov)
                                         : readCalibration(calibration, fov, sizeOfImages(mav0))) {
  std::map<std::int64_t, std::string> files[2];
  for (int side = 0; side < 2; ++side) files[side] = listImages(fs::path(mav0) / ("cam" + std::to_string(side)));
  for (const auto& [stamp, file] : files[0])
    if (const auto partner = files[1].find(stamp); partner != files[1].end())
      frames_.push_back({stamp, {file, partner->second}});
  if (frames_.empty()) throw std::runtime_error("'" + mav0 + "': cam0 and cam1 have no stamp in common");
  unpaired_ = static_cast<int>(files[0].size() + files[1].size() - 2 * frames_.size());
}

ImagePair EurocSequence::load(int i) const {
  const auto read = [this](const std::string& file) {
    const cv::Mat image = readGreyImage(file);
    if (image.size() != rectification_.raw(0).size)
      throw std::runtime_error("image '" + file + "' does not have the resolution that its calibration says");
    return image;
  };
  const Frame& frame = frames_.at(static_cast<std::size_t>(i));
  return {read(frame.files[0]), read(frame.files[1])};
}

Trajectory EurocSequence::rectifiedPoses(std::string& problem) const {
  const std::string path = (fs::path(directory_) / "cam0_ground_truth.txt").string();
  if (!fs::exists(path)) {
    problem = "there is no '" + path + "'";
    return {};
  }
  const StampedTrajectory truth = readPoses(path);
  Eigen::Matrix3d R_rect_camera;
  cv::cv2eigen(rectification_.rotation(0), R_rect_camera);
  const Eigen::Isometry3d T_camera_rect(R_rect_camera.transpose());
  Trajectory poses;
  for (const Frame& frame : frames_) {
    const auto found = std::lower_bound(truth.stamps.begin(), truth.stamps.end(), frame.stamp);
    if (found == truth.stamps.end() || *found != frame.stamp) {
      problem = "'" + path + "' has no pose at " + std::to_string(frame.stamp);
      return {};
    }
    poses.push_back(truth.poses[static_cast<std::size_t>(found - truth.stamps.begin())] * T_camera_rect);
  }
  const Eigen::Isometry3d T_first_world = poses.front().inverse();
  for (Eigen::Isometry3d& pose : poses) pose = T_first_world * pose;
  return poses;
}

std::optional<std::string> findMav0(const std::string& folder) {
  for (const fs::path& candidate : {fs::path(folder), fs::path(folder) / "mav0"})
    if (fs::is_directory(candidate / "cam0")) return candidate.string();
  return std::nullopt;
}

}  // namespace sdvo
