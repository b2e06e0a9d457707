#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "../data/text_file.hpp"
#include "run_tool.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/kitti_writer.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace fs = std::filesystem;

namespace {

/// One camera of an ASL folder.
struct AslCamera {
  std::string directory;
  cv::Size size;
  cv::Matx33d intrinsics;
  std::vector<double> distortion;             ///< k1 k2 p1 p2
  Eigen::Isometry3d T_body_camera;            ///< m
  std::map<std::int64_t, std::string> files;  ///< stamp in ns -> path of the image
};

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

void readSensor(const std::string& path, AslCamera& camera) {
  sdvo::openTextFile(path);
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
    camera.T_body_camera = sdvo::poseFromRows(upper);
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
  std::ifstream file = sdvo::openTextFile(path);
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    try {
      read_line(line);
    } catch (const std::invalid_argument& e) {
      throw std::runtime_error(sdvo::placeInFile(path, number) + ": " + e.what());
    }
  }
}

AslCamera readCamera(const fs::path& directory) {
  if (!fs::is_directory(directory)) {
    throw std::runtime_error("directory '" + directory.string() + "' is missing: --input must be a mav0 folder with " +
                             "cam0 and cam1");
  }
  AslCamera camera;
  camera.directory = directory.string();
  readSensor((directory / "sensor.yaml").string(), camera);
  const std::string list = (directory / "data.csv").string();
  readLines(list, [&](const std::string& line) {
    const std::size_t comma = line.find(',');
    if (comma == std::string::npos) throw std::invalid_argument("expected 'stamp,file name'");
    const std::size_t name = line.find_first_not_of(' ', comma + 1);
    if (name == std::string::npos) throw std::invalid_argument("the file name is missing");
    camera.files[parseStamp(line.substr(0, comma))] = (directory / "data" / line.substr(name)).string();
  });
  if (camera.files.empty()) throw std::runtime_error("file '" + list + "' lists no images");
  return camera;
}

/// How to turn both views into rectified ones.
struct Rectification {
  cv::Mat map_x[2], map_y[2];     ///< for cv::remap, left and right
  sdvo::StereoCamera camera;      ///< that they then have
  Eigen::Matrix3d R_rect_camera;  ///< of the left view
};

Rectification rectify(const AslCamera& left, const AslCamera& right) {
  if (left.size != right.size) {
    throw std::runtime_error("'" + left.directory + "' and '" + right.directory + "' differ in image resolution");
  }
  const Eigen::Isometry3d T_right_left = right.T_body_camera.inverse() * left.T_body_camera;
  cv::Mat R, T, R_rect[2], P[2], Q;
  cv::eigen2cv(Eigen::Matrix3d(T_right_left.linear()), R);
  cv::eigen2cv(Eigen::Vector3d(T_right_left.translation()), T);
  Rectification result;
  cv::stereoRectify(left.intrinsics, left.distortion, right.intrinsics, right.distortion, left.size, R, T, R_rect[0],
                    R_rect[1], P[0], P[1], Q, cv::CALIB_ZERO_DISPARITY, 0.0);
  const double fx = P[1].at<double>(0, 0), baseline = -P[1].at<double>(0, 3) / fx;
  result.camera = {fx,       P[1].at<double>(1, 1), P[1].at<double>(0, 2), P[1].at<double>(1, 2),
                   baseline, left.size.width,       left.size.height};
  if (!(baseline > 0.0)) {
    throw std::runtime_error("the T_BS of '" + right.directory + "' does not put it to the right of '" +
                             left.directory + "': are the cameras swapped?");
  }
  for (int side = 0; side < 2; ++side) {
    const AslCamera& camera = side == 0 ? left : right;
    cv::initUndistortRectifyMap(camera.intrinsics, camera.distortion, R_rect[side], P[side], camera.size, CV_32FC1,
                                result.map_x[side], result.map_y[side]);
  }
  cv::cv2eigen(R_rect[0], result.R_rect_camera);
  return result;
}

std::vector<std::int64_t> commonStamps(const AslCamera& left, const AslCamera& right) {
  std::vector<std::int64_t> stamps;
  for (const auto& entry : left.files) {
    if (right.files.count(entry.first) > 0) stamps.push_back(entry.first);
  }
  if (stamps.empty()) {
    throw std::runtime_error("'" + left.directory + "' and '" + right.directory + "' have no stamp in common");
  }
  const std::size_t dropped = left.files.size() + right.files.size() - 2 * stamps.size();
  if (dropped > 0) std::cerr << "note: " << dropped << " image(s) without a partner are left out" << std::endl;
  return stamps;
}

/// Poses T_world_camera by stamp, from lines "stamp[ns] r11 r12 r13 tx r21 … tz".
std::map<std::int64_t, Eigen::Isometry3d> readGroundTruth(const std::string& path) {
  std::map<std::int64_t, Eigen::Isometry3d> poses;
  readLines(path, [&](const std::string& line) {
    const std::vector<std::string> words = sdvo::splitWords(line);
    std::array<double, 12> rows;
    if (words.size() != rows.size() + 1) throw std::invalid_argument("expected a stamp and 12 numbers");
    std::transform(words.begin() + 1, words.end(), rows.begin(), sdvo::parseNumber<double>);
    poses[parseStamp(words.front())] = sdvo::poseFromRows(rows);
  });
  return poses;
}

/// The rectified left camera relative to its first pose; empty, with a note, when a stamp has no ground truth.
sdvo::Trajectory rectifiedPoses(const std::string& path, const std::vector<std::int64_t>& stamps,
                                const Eigen::Matrix3d& R_rect_camera) {
  if (!fs::exists(path)) {
    std::cerr << "note: there is no '" << path << "', so poses.txt is not written" << std::endl;
    return {};
  }
  const std::map<std::int64_t, Eigen::Isometry3d> ground_truth = readGroundTruth(path);
  const Eigen::Isometry3d T_camera_rect(R_rect_camera.transpose());
  sdvo::Trajectory poses;
  for (const std::int64_t stamp : stamps) {
    const auto found = ground_truth.find(stamp);
    if (found == ground_truth.end()) {
      std::cerr << "note: '" << path << "' has no pose at " << stamp << ", so poses.txt is not written" << std::endl;
      return {};
    }
    poses.push_back(found->second * T_camera_rect);
  }
  const Eigen::Isometry3d T_first_world = poses.front().inverse();
  for (Eigen::Isometry3d& pose : poses) pose = T_first_world * pose;
  return poses;
}

void writeImages(const AslCamera& left, const AslCamera& right, const Rectification& rectification,
                 const std::vector<std::int64_t>& stamps, const sdvo::KittiWriter& output) {
  sdvo::Progress progress("rectifying", static_cast<int>(stamps.size()));
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    for (int side = 0; side < 2; ++side) {
      const std::string& source = (side == 0 ? left : right).files.at(stamps[i]);
      const cv::Mat raw = sdvo::readGreyPng(source);
      if (raw.size() != left.size) {
        throw std::runtime_error("image '" + source + "' does not have the resolution that sensor.yaml says");
      }
      cv::Mat image;
      cv::remap(raw, image, rectification.map_x[side], rectification.map_y[side], cv::INTER_LINEAR);
      output.writeImage(side, static_cast<int>(i), image);
    }
    progress.step();
  }
}

void convert(const fs::path& input, const std::string& output_path) {
  const AslCamera left = readCamera(input / "cam0");
  const AslCamera right = readCamera(input / "cam1");
  const Rectification rectification = rectify(left, right);
  const std::vector<std::int64_t> stamps = commonStamps(left, right);
  const sdvo::Trajectory poses =
      rectifiedPoses((input / "cam0_ground_truth.txt").string(), stamps, rectification.R_rect_camera);

  sdvo::KittiWriter output(output_path);
  writeImages(left, right, rectification, stamps, output);
  const sdvo::StereoCamera& camera = rectification.camera;
  std::vector<std::int64_t> since_first;
  for (const std::int64_t stamp : stamps) since_first.push_back(stamp - stamps.front());
  output.finish(camera, since_first, poses);
  std::printf("%zu pairs of %dx%d px, f = %.3f px, baseline = %.5f m, first stamp %lld ns\n", stamps.size(),
              camera.width, camera.height, camera.fx, camera.baseline, static_cast<long long>(stamps.front()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Rectifies an EuRoC (ASL) folder into the KITTI layout: image_0, image_1, calib.txt, times.txt (seconds since "
      "the first stamp) and, where cam0_ground_truth.txt exists, poses.txt of the rectified left camera.");
  std::string input, output;
  app.add_option("--input", input, "The mav0 folder with cam0 and cam1")->required();
  app.add_option("--output", output, "Directory to create")->required();
  return sdvo::runTool(app, argc, argv, [&] {
    convert(input, output);
    return 0;
  });
}
