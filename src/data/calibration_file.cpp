#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "../common/text.hpp"
#include "stereo_rectification.hpp"
#include "text_file.hpp"

namespace sdvo {
namespace {

template <class T>
T read(const YAML::Node& node, const std::string& name) {
  if (!node[name]) throw std::invalid_argument("there is no '" + name + "'");
  return node[name].as<T>();
}

/// A list with the length of `Values`.
template <class Values>
Values readList(const YAML::Node& node, const std::string& name) {
  const auto list = read<std::vector<double>>(node, name);
  Values values;
  if (list.size() != std::size(values))
    throw std::invalid_argument("expected a list '" + name + "' of " + std::to_string(std::size(values)));
  std::copy(list.begin(), list.end(), std::begin(values));
  return values;
}

Eigen::Isometry3d poseOf(const std::array<double, 16>& rows) {
  std::array<double, 12> upper;
  std::copy_n(rows.begin(), upper.size(), upper.begin());
  return poseFromRows(upper);
}

/// A camera of Kalibr or EuRoC, whose formats differ in the name of the coefficients.
RawCamera readCamera(const YAML::Node& node, const std::string& coefficients) {
  if (const auto model = read<std::string>(node, "camera_model"); model != "pinhole")
    throw std::invalid_argument("camera_model '" + model + "' is not supported, only 'pinhole' is");
  RawCamera camera;
  const auto size = readList<std::array<int, 2>>(node, "resolution");
  const auto k = readList<std::array<double, 4>>(node, "intrinsics");
  camera.size = {size[0], size[1]};
  camera.K = {k[0], 0.0, k[2], 0.0, k[1], k[3], 0.0, 0.0, 1.0};
  const auto model = read<std::string>(node, "distortion_model");
  camera.setLens(model, model == "none" ? std::vector<double>() : read<std::vector<double>>(node, coefficients));
  return camera;
}

StereoRectification readChain(const YAML::Node& chain, double fov) {
  std::array<double, 16> rows{};
  auto row = rows.begin();
  for (const auto& values : read<std::vector<std::array<double, 4>>>(chain["cam1"], "T_cn_cnm1"))
    if (row != rows.end()) row = std::copy(values.begin(), values.end(), row);
  const std::string coefficients = "distortion_coeffs";
  return {{readCamera(chain["cam0"], coefficients), readCamera(chain["cam1"], coefficients)}, poseOf(rows), fov};
}

StereoRectification readSensors(const YAML::Node (&sensors)[2], double fov) {
  RawCameras cameras;
  Eigen::Isometry3d T_body_camera[2];
  for (std::size_t side : {0u, 1u}) {
    cameras[side] = readCamera(sensors[side], "distortion_coefficients");
    T_body_camera[side] = poseOf(readList<std::array<double, 16>>(sensors[side]["T_BS"], "data"));
  }
  StereoRectification rectification(cameras, T_body_camera[1].inverse() * T_body_camera[0], fov);
  rectification.mount(T_body_camera[0]);
  return rectification;
}

StereoRectification readInfos(const YAML::Node (&infos)[2], double fov) {
  RawCameras cameras;
  std::array<cv::Matx33d, 2> rotations;
  std::array<double, 12> P[2];
  for (std::size_t side : {0u, 1u}) {
    const YAML::Node& info = infos[side];
    cameras[side].size = {read<int>(info, "image_width"), read<int>(info, "image_height")};
    cameras[side].K = cv::Matx33d(readList<std::array<double, 9>>(info["camera_matrix"], "data").data());
    cameras[side].setLens(read<std::string>(info, "distortion_model"),
                          read<std::vector<double>>(info["distortion_coefficients"], "data"));
    rotations[side] = cv::Matx33d(readList<std::array<double, 9>>(info["rectification_matrix"], "data").data());
    P[side] = readList<std::array<double, 12>>(info["projection_matrix"], "data");
  }
  for (const std::size_t i : {0u, 2u, 5u, 6u})
    if (!(std::abs(P[0][i] - P[1][i]) < 0.05) || cameras[0].size != cameras[1].size)  // px, as of the nodelets
      throw std::invalid_argument(text(3, "projection_matrix is ", P[0][i], " on the left and ", P[1][i],
                                       " on the right, or the sizes differ: calibrate both cameras as one pair"));
  const StereoCamera camera{
      P[0][0], P[0][5], P[0][2], P[0][6], (P[0][3] - P[1][3]) / P[0][0], cameras[0].size.width, cameras[0].size.height};
  camera.check();
  return {cameras, rotations, fov > 0.0 ? withFieldOfView(camera, fov) : camera};
}

}  // namespace

StereoRectification readCalibration(const std::vector<std::string>& files, double fov) {
  std::string names;
  for (const std::string& file : files) names += (names.empty() ? "file '" : ", '") + file + "'";
  try {
    YAML::Node nodes[2];
    for (std::size_t i = 0; i < files.size() && i < 2; ++i) {
      openTextFile(files[i]);
      nodes[i] = YAML::LoadFile(files[i]);
    }
    const auto has = [&](const char* name) {
      return nodes[0].IsMap() && nodes[0][name] && (files.size() == 1 || (nodes[1].IsMap() && nodes[1][name]));
    };
    if (files.size() == 1 && has("cam0") && has("cam1")) return readChain(nodes[0], fov);
    if (files.size() == 2 && has("camera_matrix")) return readInfos(nodes, fov);
    if (files.size() == 2 && has("T_BS")) return readSensors(nodes, fov);
    throw std::invalid_argument(
        "no calibration of two cameras: one file of Kalibr's (cam0, cam1), or two, left and right, of camera_info "
        "(camera_matrix, …) or EuRoC's sensor.yaml (T_BS, …)");
  } catch (const std::exception& e) {
    throw std::runtime_error(names + ": " + e.what());
  }
}

}  // namespace sdvo
