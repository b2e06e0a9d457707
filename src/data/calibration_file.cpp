#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <opencv2/core/persistence.hpp>
#include <sstream>
#include <stdexcept>

#include "../common/text.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_rectification.hpp"
#include "text_file.hpp"

namespace sdvo {
namespace {

using YAML::Node;
using Nodes = std::vector<Node>;  ///< one for each file

bool has(const Node& node, const std::string& name) {
  return node.IsMap() && node[name];
}

Node get(const Node& node, const std::string& name) {
  if (!has(node, name)) throw std::invalid_argument("there is no '" + name + "'");
  return node[name];
}

template <class T>
T read(const Node& node, const std::string& name) try {
  return get(node, name).as<T>();
} catch (const YAML::Exception&) {
  throw std::invalid_argument("'" + name + "' has no value of its type");
}

/// All numbers of a list, of a list of rows, or of a matrix that has them in `data`.
void appendNumbers(const Node& node, std::vector<double>& numbers) {
  if (node.IsMap()) return appendNumbers(get(node, "data"), numbers);
  if (node.IsSequence())
    for (const Node& element : node) appendNumbers(element, numbers);
  else
    numbers.push_back(parseNumber(node.as<std::string>()));
}

/// `counts`: those that are expected; none: any.
std::vector<double> numbers(const Node& node, const std::string& name, const std::vector<std::size_t>& counts = {}) {
  std::vector<double> values;
  appendNumbers(get(node, name), values);
  if (!counts.empty() && std::count(counts.begin(), counts.end(), values.size()) == 0)
    throw std::invalid_argument(text(0, "expected a list '", name, "' of ", counts.front(), ", found ", values.size()));
  return values;
}

/// With or without the last row of 0 0 0 1.
Eigen::Isometry3d readPose(const Node& node, const std::string& name) {
  const std::vector<double> rows = numbers(node, name, {16, 12});
  std::array<double, 12> upper;
  std::copy_n(rows.begin(), upper.size(), upper.begin());
  return poseFromRows(upper);
}

cv::Matx33d matrixOf(double fx, double fy, double cx, double cy) {
  return {fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0};
}

cv::Matx33d readMatrix(const Node& node, const std::string& name) {
  return cv::Matx33d(numbers(node, name, {9}).data());
}

/// A camera with the rotation and projection (3x4) of its rectified image.
struct RectifiedView {
  RawCamera raw;
  cv::Matx33d R = cv::Matx33d::eye();
  std::vector<double> P;
};

/// Names of its entries; an empty `model` is plumb_bob.
struct ViewNames {
  std::string width, height, K, model, D, R, P;
};

RectifiedView readView(const Node& node, const ViewNames& names) {
  RectifiedView view;
  view.raw.size = {read<int>(node, names.width), read<int>(node, names.height)};
  view.raw.K = readMatrix(node, names.K);
  view.raw.setLens(names.model.empty() ? "plumb_bob" : read<std::string>(node, names.model), numbers(node, names.D));
  view.R = readMatrix(node, names.R);
  view.P = numbers(node, names.P, {12});
  return view;
}

StereoRectification ofViews(const std::array<RectifiedView, 2>& views, double fov) {
  const auto& [left, right] = views;
  for (const std::size_t i : {0u, 2u, 5u, 6u})
    if (!(std::abs(left.P[i] - right.P[i]) < 0.05) || left.raw.size != right.raw.size)  // px, as of the nodelets
      throw std::invalid_argument(text(3, "the projection is ", left.P[i], " on the left and ", right.P[i],
                                       " on the right, or the sizes differ: calibrate both cameras as one pair"));
  const StereoCamera camera{left.P[0],
                            left.P[5],
                            left.P[2],
                            left.P[6],
                            (left.P[3] - right.P[3]) / left.P[0],
                            left.raw.size.width,
                            left.raw.size.height};
  if (camera.baseline < 0.0)
    throw std::invalid_argument(text(6, "the baseline is ", camera.baseline, " m: are the cameras swapped?"));
  camera.check();
  return {{left.raw, right.raw}, {left.R, right.R}, fov > 0.0 ? withFieldOfView(camera, fov) : camera};
}

// Kalibr and EuRoC

/// The formats differ in the name of the coefficients.
RawCamera readCamera(const Node& node, const std::string& coefficients) {
  if (const auto model = read<std::string>(node, "camera_model"); model != "pinhole")
    throw std::invalid_argument("camera_model '" + model + "' is not supported, only 'pinhole' is");
  RawCamera camera;
  const auto size = numbers(node, "resolution", {2}), k = numbers(node, "intrinsics", {4});
  camera.size = {static_cast<int>(size[0]), static_cast<int>(size[1])};
  camera.K = matrixOf(k[0], k[1], k[2], k[3]);
  const auto model = read<std::string>(node, "distortion_model");
  camera.setLens(model, model == "none" ? std::vector<double>() : numbers(node, coefficients));
  return camera;
}

StereoRectification readChain(const Nodes& files, double fov, cv::Size) {
  const Node left = get(files.front(), "cam0"), right = get(files.back(), files.size() == 1 ? "cam1" : "cam0");
  const RawCameras cameras{readCamera(left, "distortion_coeffs"), readCamera(right, "distortion_coeffs")};
  if (has(right, "T_cn_cnm1")) return {cameras, readPose(right, "T_cn_cnm1"), fov};
  if (!has(left, "T_cam_imu") || !has(right, "T_cam_imu"))
    throw std::invalid_argument(
        "there is neither 'T_cn_cnm1' of cam1 nor 'T_cam_imu' of both cameras: calibrate them as one pair");
  return {cameras, readPose(right, "T_cam_imu") * readPose(left, "T_cam_imu").inverse(), fov};
}

StereoRectification readSensors(const Nodes& files, double fov, cv::Size) {
  RawCameras cameras;
  Eigen::Isometry3d T_body_camera[2];
  for (std::size_t side : {0u, 1u}) {
    cameras[side] = readCamera(files[side], "distortion_coefficients");
    T_body_camera[side] = readPose(files[side], "T_BS");
  }
  StereoRectification rectification(cameras, T_body_camera[1].inverse() * T_body_camera[0], fov);
  rectification.mount(T_body_camera[0]);
  return rectification;
}

// ROS

StereoRectification readInfos(const Nodes& files, double fov, cv::Size) {
  const ViewNames names{"image_width",      "image_height",          "camera_matrix",
                        "distortion_model", "distortion_coefficients", "rectification_matrix",
                        "projection_matrix"};
  return ofViews({readView(files[0], names), readView(files[1], names)}, fov);
}

/// A message of camera_info as rostopic or ros2 prints it.
StereoRectification readMessages(const Nodes& files, double fov, cv::Size) {
  const auto view = [](const Node& info) {
    return has(info, "K") ? readView(info, {"width", "height", "K", "distortion_model", "D", "R", "P"})
                          : readView(info, {"width", "height", "k", "distortion_model", "d", "r", "p"});
  };
  return ofViews({view(files[0]), view(files[1])}, fov);
}

/// Videre's text, of one or both cameras: sections of [image] and [NAME], and numbers below the names of matrices.
Nodes parseOst(const std::string& text) {
  static const std::pair<const char*, const char*> kNames[] = {{"camera matrix", "camera_matrix"},
                                                               {"distortion", "distortion_coefficients"},
                                                               {"rectification", "rectification_matrix"},
                                                               {"projection", "projection_matrix"},
                                                               {"width", "image_width"},
                                                               {"height", "image_height"}};
  Nodes cameras;
  Node size;
  std::string name;
  bool is_size = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::vector<std::string> words = splitWords(line);
    if (words.empty() || words[0][0] == '#') continue;
    if (words[0][0] == '[') {
      if ((is_size = words[0] == "[image]")) continue;
      cameras.push_back(YAML::Clone(size));
      cameras.back()["distortion_model"] = "plumb_bob";
      continue;
    }
    if (words[0].find_first_not_of("+-.0123456789eE") != std::string::npos) {
      name = line.substr(0, line.find_last_not_of(" \t\r") + 1);
      for (const auto& [theirs, ours] : kNames)
        if (name == theirs) name = ours;
      continue;
    }
    if (is_size) size[name] = words[0];
    for (const std::string& word : words)
      if (!is_size && !cameras.empty()) cameras.back()[name].push_back(word);
  }
  return cameras;
}

// OpenCV

const std::vector<const char*> kLeftK = {"M1", "K1", "cameraMatrix1", "camera_matrix_1", "cameraMatrixL", "K_left"},
                               kRightK = {"M2", "K2", "cameraMatrix2", "camera_matrix_2", "cameraMatrixR", "K_right"};

/// Index of the first of these names; their number: none.
std::size_t indexIn(const Node& node, const std::vector<const char*>& names) {
  return static_cast<std::size_t>(
      std::find_if(names.begin(), names.end(), [&](const char* name) { return has(node, name); }) - names.begin());
}

/// Of cv::stereoCalibrate and cv::stereoRectify, in one file or two, which may lack the size of the images.
StereoRectification readOpenCv(const Nodes& files, double fov, cv::Size images) {
  static const std::vector<const char*> left_D = {"D1",          "D1",          "distCoeffs1",
                                                  "dist_coeffs_1", "distCoeffsL", "D_left"},
                                        right_D = {"D2",          "D2",          "distCoeffs2",
                                                   "dist_coeffs_2", "distCoeffsR", "D_right"};
  Node all;
  for (const Node& file : files)
    for (const auto& entry : file) all[entry.first] = entry.second;
  const std::size_t style = indexIn(all, kLeftK);
  std::array<RectifiedView, 2> views;
  for (std::size_t side : {0u, 1u}) {
    RawCamera& raw = views[side].raw;
    raw.size = images.area() > 0 && !has(all, "image_width")
                   ? images
                   : cv::Size(read<int>(all, "image_width"), read<int>(all, "image_height"));
    raw.K = readMatrix(all, (side == 0 ? kLeftK : kRightK)[style]);
    raw.setLens("plumb_bob", numbers(all, (side == 0 ? left_D : right_D)[style]));
  }
  if (has(all, "R1") && has(all, "R2") && has(all, "P1") && has(all, "P2")) {
    for (std::size_t side : {0u, 1u}) {
      views[side].R = readMatrix(all, side == 0 ? "R1" : "R2");
      views[side].P = numbers(all, side == 0 ? "P1" : "P2", {12});
    }
    return ofViews(views, fov);
  }
  const std::vector<double> R = numbers(all, "R", {9}), T = numbers(all, "T", {3});
  return {{views[0].raw, views[1].raw},
          poseFromRows({R[0], R[1], R[2], T[0], R[3], R[4], R[5], T[1], R[6], R[7], R[8], T[2]}),
          fov};
}

// ORB-SLAM

StereoRectification readOrbSlam2(const Nodes& files, double fov, cv::Size) {
  const auto view = [&](const std::string& of) {
    return readView(files[0], {of + "width", of + "height", of + "K", "", of + "D", of + "R", of + "P"});
  };
  return ofViews({view("LEFT."), view("RIGHT.")}, fov);
}

/// A camera of ORB-SLAM's or VINS' keys: fx, fy, cx, cy, and those of its coefficients that there are.
RawCamera cameraOfKeys(const Node& node, const std::string& prefix, const std::string& lens, const Node& distortion) {
  RawCamera camera;
  const auto key = [&](const char* name) { return read<double>(node, prefix + name); };
  camera.K = matrixOf(key("fx"), key("fy"), key("cx"), key("cy"));
  std::vector<double> coefficients;
  static const std::vector<const char*> kRadtan = {"k1", "k2", "p1", "p2", "k3"}, kFisheye = {"k1", "k2", "k3", "k4"};
  for (const char* name : lens == "fisheye" ? kFisheye : kRadtan)
    if (has(distortion, prefix + name)) coefficients.push_back(read<double>(distortion, prefix + name));
  camera.setLens(lens, coefficients);
  return camera;
}

cv::Size readOrbSlamSize(const Node& file) {
  return {read<int>(file, "Camera.width"), read<int>(file, "Camera.height")};
}

StereoRectification readOrbSlam3(const Nodes& files, double fov, cv::Size) {
  const Node& file = files[0];
  const auto type = read<std::string>(file, "Camera.type");
  if (type != "PinHole" && type != "KannalaBrandt8")
    throw std::invalid_argument("Camera.type '" + type + "' is not supported: PinHole, KannalaBrandt8, Rectified are");
  RawCameras cameras;
  for (std::size_t side : {0u, 1u}) {
    cameras[side] =
        cameraOfKeys(file, side == 0 ? "Camera1." : "Camera2.", type == "PinHole" ? "radtan" : "fisheye", file);
    cameras[side].size = readOrbSlamSize(file);
  }
  return {cameras, readPose(file, "Stereo.T_c1_c2").inverse(), fov};
}

/// ORB-SLAM's files of rectified images have the baseline alone.
StereoRectification readOrbSlamRectified(const Nodes& files, double fov, cv::Size) {
  const Node& file = files[0];
  const std::string prefix = has(file, "Camera1.fx") ? "Camera1." : "Camera.";
  std::array<RectifiedView, 2> views;
  for (std::size_t side : {0u, 1u}) {
    RectifiedView& view = views[side];
    view.raw = cameraOfKeys(file, prefix, "none", Node());
    view.raw.size = readOrbSlamSize(file);
    const cv::Matx33d& K = view.raw.K;
    const double bf = has(file, "Stereo.b") ? read<double>(file, "Stereo.b") * K(0, 0) : read<double>(file, "Camera.bf");
    view.P = {K(0, 0), 0.0, K(0, 2), side == 0 ? 0.0 : -bf, 0.0, K(1, 1), K(1, 2), 0.0, 0.0, 0.0, 1.0, 0.0};
  }
  return ofViews(views, fov);
}

// VINS

/// The configuration (body_T_cam0, body_T_cam1), and the files of both cameras that it names or that are given.
StereoRectification readVins(const Nodes& files, double fov, cv::Size) {
  const auto config = std::find_if(files.begin(), files.end(), [](const Node& n) { return has(n, "body_T_cam0"); });
  if (config == files.end() || files.size() != 3)
    throw std::invalid_argument(
        "these are VINS' files of single cameras, without the pose between them: give its configuration alone, which "
        "has body_T_cam0, body_T_cam1, cam0_calib and cam1_calib");
  RawCameras cameras;
  std::size_t side = 0;
  for (const Node& file : files) {
    if (file == *config) continue;
    const auto model = read<std::string>(file, "model_type");
    if (model == "PINHOLE") {
      cameras[side] = cameraOfKeys(get(file, "projection_parameters"), "", "radtan", get(file, "distortion_parameters"));
    } else if (model == "KANNALA_BRANDT") {
      const Node k = get(file, "projection_parameters");
      const auto key = [&](const char* name) { return read<double>(k, name); };
      cameras[side].K = matrixOf(key("mu"), key("mv"), key("u0"), key("v0"));
      cameras[side].setLens("fisheye", {key("k2"), key("k3"), key("k4"), key("k5")});
    } else {
      throw std::invalid_argument("model_type '" + model + "' is not supported: PINHOLE and KANNALA_BRANDT are");
    }
    cameras[side++].size = {read<int>(file, "image_width"), read<int>(file, "image_height")};
  }
  const Eigen::Isometry3d T_body_left = readPose(*config, "body_T_cam0");
  StereoRectification rectification(cameras, readPose(*config, "body_T_cam1").inverse() * T_body_left, fov);
  rectification.mount(T_body_left);
  return rectification;
}

// Files

/// A format of calibrations, known by one of its keys. `files`: as many as it may have.
struct Format {
  const char* name;
  std::vector<const char*> keys;
  std::vector<std::size_t> files;
  StereoRectification (*read)(const Nodes&, double fov, cv::Size images);
  bool has_parts = false;  ///< the files complement each other: not all have a key
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"Kalibr's camera chain (cam0, cam1)", {"cam0"}, {1, 2}, readChain},
      {"camera_info's YAML or ost.txt (camera_matrix, …), left and right", {"camera_matrix"}, {2}, readInfos},
      {"messages of camera_info (rostopic echo), left and right", {"K", "k"}, {2}, readMessages},
      {"EuRoC's sensor.yaml (T_BS, …), left and right", {"T_BS"}, {2}, readSensors},
      {"OpenCV's intrinsics and extrinsics (M1, D1, M2, D2, R, T)", kLeftK, {1, 2}, readOpenCv, true},
      {"ORB-SLAM2's settings (LEFT.K, …)", {"LEFT.K"}, {1}, readOrbSlam2},
      {"ORB-SLAM3's settings (Camera1.fx, Stereo.T_c1_c2)", {"Stereo.T_c1_c2"}, {1}, readOrbSlam3},
      {"ORB-SLAM's settings of rectified images (Camera.bf or Stereo.b)",
       {"Stereo.b", "Camera.bf"},
       {1},
       readOrbSlamRectified},
      {"VINS' configuration (body_T_cam0, …)", {"body_T_cam0", "model_type"}, {2, 3}, readVins, true},
  };
  return all;
}

/// XML of cv::FileStorage.
Node nodeOf(const cv::FileNode& value) {
  Node node;
  if (value.isMap())
    for (const auto& child : value) node[child.name()] = nodeOf(child);
  else if (value.isSeq())
    for (const auto& child : value) node.push_back(nodeOf(child));
  else if (value.isString())
    node = static_cast<std::string>(value);
  else if (value.isInt() || value.isReal())
    node = static_cast<double>(value);
  return node;
}

/// The first document of a file: YAML, JSON, XML of OpenCV's, or ost.txt, which may have two cameras.
Nodes readDocuments(const std::string& path) {
  std::ifstream file = openTextFile(path);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (text.find("# oST") != std::string::npos) return parseOst(text);
  if (text.rfind("<?xml", 0) == 0) try {
      return {nodeOf(cv::FileStorage(path, cv::FileStorage::READ).root())};
    } catch (const cv::Exception& e) {
      throw std::invalid_argument("the XML cannot be read: " + e.err);
    }
  if (const std::size_t head = text.find("%YAML"); head != std::string::npos && head <= 3)
    text.erase(head, text.find('\n', head) - head);  // OpenCV's %YAML:1.0 is no YAML
  try {
    return {YAML::Load(text)};
  } catch (const YAML::Exception& e) {
    throw std::invalid_argument(std::string(e.what()) + (text.find('\t') != std::string::npos
                                                             ? " (YAML allows no tabs at the begin of a line)"
                                                             : " (is it half a file?)"));
  }
}

}  // namespace

StereoRectification readCalibration(const std::vector<std::string>& files, double fov, cv::Size size) {
  std::string names;
  for (const std::string& file : files) names += (names.empty() ? "file '" : ", '") + file + "'";
  try {
    Nodes nodes;
    for (const std::string& file : files)
      for (const Node& node : readDocuments(file)) nodes.push_back(node);
    if (nodes.size() == 1 && has(nodes[0], "body_T_cam0"))
      for (const char* camera : {"cam0_calib", "cam1_calib"}) {
        const auto beside = std::filesystem::path(files[0]).parent_path() / read<std::string>(nodes[0], camera);
        nodes.push_back(readDocuments(beside.string()).at(0));
      }
    std::string known, is;
    for (const Format& format : formats()) {
      known += (known.empty() ? "" : "; ") + std::string(format.name);
      const auto matches = [&](const Node& node) { return indexIn(node, format.keys) < format.keys.size(); };
      const auto matching = static_cast<std::size_t>(std::count_if(nodes.begin(), nodes.end(), matches));
      if (matching < (format.has_parts ? 1 : nodes.size())) continue;
      if (std::count(format.files.begin(), format.files.end(), nodes.size()) > 0) {
        return format.read(nodes, fov, size);
      }
      is = std::string("of one camera alone, or too many: ") + format.name + ". ";
    }
    throw std::invalid_argument(is + "No calibration of two cameras. One file each, or two, left and right: " + known);
  } catch (const std::exception& e) {
    throw std::runtime_error(names + ": " + e.what());
  }
}

}  // namespace sdvo
