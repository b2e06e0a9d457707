#include "stereo_descriptor_vo/data/euroc_dataset.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "text_file.hpp"

namespace fs = std::filesystem;

namespace sdvo {
namespace {

template <class T>
std::vector<T> readList(const YAML::Node& node, const std::string& name, std::size_t size) {
  const std::vector<T> values = node[name] ? node[name].as<std::vector<T>>() : std::vector<T>();
  if (values.size() != size) throw std::invalid_argument("expected a list '" + name + "' of " + std::to_string(size));
  return values;
}

void requireText(const YAML::Node& node, const std::string& name, const std::string& supported) {
  const std::string value = node[name] ? node[name].as<std::string>() : "";
  if (value != supported) {
    throw std::invalid_argument(name + " '" + value + "' is not supported, only '" + supported + "' is");
  }
}

void readSensor(const std::string& path, EurocCamera& camera) {
  openTextFile(path);
  try {
    const YAML::Node node = YAML::LoadFile(path);
    requireText(node, "camera_model", "pinhole");
    requireText(node, "distortion_model", "radial-tangential");
    const std::vector<int> size = readList<int>(node, "resolution", 2);
    camera.size = cv::Size(size[0], size[1]);
    const std::vector<double> k = readList<double>(node, "intrinsics", 4);
    camera.intrinsics = cv::Matx33d(k[0], 0.0, k[2], 0.0, k[1], k[3], 0.0, 0.0, 1.0);
    camera.distortion = readList<double>(node, "distortion_coefficients", 4);
    if (!node["T_BS"]) throw std::invalid_argument("expected a matrix 'T_BS'");
    const std::vector<double> rows = readList<double>(node["T_BS"], "data", 16);
    std::array<double, 12> upper;
    std::copy(rows.begin(), rows.begin() + 12, upper.begin());
    camera.T_body_camera = poseFromRows(upper);
  } catch (const std::exception& e) {
    throw std::runtime_error("file '" + path + "': " + e.what());
  }
}

std::int64_t parseStamp(const std::string& word) {
  if (word.empty() || word.size() > 18 + 1 || word.find_first_not_of("0123456789") != std::string::npos) {
    throw std::invalid_argument("'" + word + "' is not a stamp in nanoseconds");
  }
  return std::stoll(word);
}

/// Calls `read_line(text)` for every line that is neither empty nor a comment; its std::invalid_argument gets file and
/// line.
template <class ReadLine>
void readLines(const std::string& path, const ReadLine& read_line) {
  std::ifstream file = openTextFile(path);
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    try {
      read_line(line);
    } catch (const std::invalid_argument& e) {
      throw std::runtime_error(placeInFile(path, number) + ": " + e.what());
    }
  }
}

/// Paths of a camera's images by stamp in ns.
std::map<std::int64_t, std::string> listImages(const fs::path& directory) {
  std::map<std::int64_t, std::string> files;
  const std::string list = (directory / "data.csv").string();
  readLines(list, [&](const std::string& line) {
    const std::size_t comma = line.find(',');
    if (comma == std::string::npos) throw std::invalid_argument("expected 'stamp,file name'");
    const std::size_t name = line.find_first_not_of(' ', comma + 1);
    if (name == std::string::npos) throw std::invalid_argument("the file name is missing");
    files[parseStamp(line.substr(0, comma))] = (directory / "data" / line.substr(name)).string();
  });
  if (files.empty()) throw std::runtime_error("file '" + list + "' lists no images");
  return files;
}

StereoRectification rectify(const EurocCamera& left, const EurocCamera& right) {
  const Eigen::Isometry3d T_right_left = right.T_body_camera.inverse() * left.T_body_camera;
  cv::Mat R, T, R_rect[2], P[2], Q;
  cv::eigen2cv(Eigen::Matrix3d(T_right_left.linear()), R);
  cv::eigen2cv(Eigen::Vector3d(T_right_left.translation()), T);
  cv::stereoRectify(left.intrinsics, left.distortion, right.intrinsics, right.distortion, left.size, R, T, R_rect[0],
                    R_rect[1], P[0], P[1], Q, cv::CALIB_ZERO_DISPARITY, 0.0);
  StereoRectification result;
  for (int side = 0; side < 2; ++side) {
    result.rotations[side] = R_rect[side];
    result.projections[side] = P[side];
  }
  const cv::Matx34d& p = result.projections[1];
  result.camera = {p(0, 0), p(1, 1), p(0, 2), p(1, 2), -p(0, 3) / p(0, 0), left.size.width, left.size.height};
  return result;
}

/// Poses T_world_camera by stamp, from lines "stamp[ns] r11 r12 r13 tx r21 … tz".
std::map<std::int64_t, Eigen::Isometry3d> readGroundTruth(const std::string& path) {
  std::map<std::int64_t, Eigen::Isometry3d> poses;
  readLines(path, [&](const std::string& line) {
    const std::vector<std::string> words = splitWords(line);
    std::array<double, 12> rows;
    if (words.size() != rows.size() + 1) throw std::invalid_argument("expected a stamp and 12 numbers");
    std::transform(words.begin() + 1, words.end(), rows.begin(), parseNumber<double>);
    poses[parseStamp(words.front())] = poseFromRows(rows);
  });
  return poses;
}

}  // namespace

EurocSequence::EurocSequence(const std::string& mav0) : directory_(mav0) {
  const std::string names[2] = {"cam0", "cam1"};
  std::map<std::int64_t, std::string> files[2];
  for (int side = 0; side < 2; ++side) {
    const fs::path directory = fs::path(mav0) / names[side];
    if (!fs::is_directory(directory))
      throw std::runtime_error("directory '" + directory.string() +
                               "' is missing: a mav0 folder with cam0 and cam1 is expected");
    readSensor((directory / "sensor.yaml").string(), cameras_[side]);
    files[side] = listImages(directory);
  }
  if (cameras_[0].size != cameras_[1].size)
    throw std::runtime_error("'" + mav0 + "': cam0 and cam1 differ in image resolution");
  rectification_ = rectify(cameras_[0], cameras_[1]);
  if (!(rectification_.camera.baseline > 0.0))
    throw std::runtime_error("'" + mav0 + "': T_BS does not put cam1 to the right of cam0: are the cameras swapped?");
  for (int side = 0; side < 2; ++side)
    cv::initUndistortRectifyMap(cameras_[side].intrinsics, cameras_[side].distortion, rectification_.rotations[side],
                                rectification_.projections[side], cameras_[side].size, CV_32FC1, map_x_[side],
                                map_y_[side]);
  for (const auto& [stamp, file] : files[0])
    if (const auto partner = files[1].find(stamp); partner != files[1].end())
      frames_.push_back({stamp, {file, partner->second}});
  if (frames_.empty()) throw std::runtime_error("'" + mav0 + "': cam0 and cam1 have no stamp in common");
  unpaired_ = static_cast<int>(files[0].size() + files[1].size() - 2 * frames_.size());
}

ImagePair EurocSequence::load(int i) const {
  const auto read = [this](const std::string& file) {
    const cv::Mat image = readGreyPng(file);
    if (image.size() != cameras_[0].size)
      throw std::runtime_error("image '" + file + "' does not have the resolution that sensor.yaml says");
    return image;
  };
  const Frame& frame = frames_.at(static_cast<std::size_t>(i));
  return {read(frame.files[0]), read(frame.files[1])};
}

ImagePair EurocSequence::loadRectified(int i) const {
  const ImagePair raw = load(i);
  ImagePair pair;
  cv::remap(raw.left, pair.left, map_x_[0], map_y_[0], cv::INTER_LINEAR);
  cv::remap(raw.right, pair.right, map_x_[1], map_y_[1], cv::INTER_LINEAR);
  return pair;
}

Trajectory EurocSequence::rectifiedPoses(std::string& problem) const {
  const std::string path = (fs::path(directory_) / "cam0_ground_truth.txt").string();
  if (!fs::exists(path)) {
    problem = "there is no '" + path + "'";
    return {};
  }
  const std::map<std::int64_t, Eigen::Isometry3d> ground_truth = readGroundTruth(path);
  Eigen::Matrix3d R_rect_camera;
  cv::cv2eigen(rectification_.rotations[0], R_rect_camera);
  const Eigen::Isometry3d T_camera_rect(R_rect_camera.transpose());
  Trajectory poses;
  for (const Frame& frame : frames_) {
    const auto found = ground_truth.find(frame.stamp);
    if (found == ground_truth.end()) {
      problem = "'" + path + "' has no pose at " + std::to_string(frame.stamp);
      return {};
    }
    poses.push_back(found->second * T_camera_rect);
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
