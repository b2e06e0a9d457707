#pragma once

#include <Eigen/Geometry>
#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

namespace sdvo {

/// A raw camera in OpenCV's models.
struct RawCamera {
  cv::Size size;
  cv::Matx33d K;
  std::vector<double> D;        ///< pinhole: k1 k2 p1 p2 [k3 [k4 k5 k6 …]]; equidistant: k1 k2 k3 k4
  bool is_equidistant = false;  ///< cv::fisheye

  /// `model`: its name in ROS, Kalibr or EuRoC. Throws std::invalid_argument that names the supported models.
  void setLens(const std::string& model, std::vector<double> coefficients);
};

using RawCameras = std::array<RawCamera, 2>;  ///< left, right

/// Rectification of the raw images of two cameras, by OpenCV.
class StereoRectification {
 public:
  /// From a calibration: `rotations` from each raw camera's axes to the rectified ones, and the rectified camera.
  StereoRectification(const RawCameras& raw, const std::array<cv::Matx33d, 2>& rotations, const StereoCamera& camera);

  /// From the relative pose. `fov`: horizontal field of view of the rectified images, deg; 0: the largest without black
  /// borders, at most 110. Throws std::invalid_argument if the second camera is not to the right of the first one.
  StereoRectification(const RawCameras& raw, const Eigen::Isometry3d& T_right_left, double fov = 0.0);

  const RawCamera& raw(int side) const { return raw_[static_cast<std::size_t>(side)]; }
  const cv::Matx33d& rotation(int side) const { return rotations_[static_cast<std::size_t>(side)]; }
  /// Of the rectified views.
  const StereoCamera& camera() const { return camera_; }

  /// Pose of the rectified left camera on the body that the calibration names (EuRoC's T_BS); identity without one.
  const Eigen::Isometry3d& T_body_left() const { return T_body_left_; }
  void mount(const Eigen::Isometry3d& T_body_raw_left);

  ImagePair rectify(const ImagePair& raw) const;

 private:
  void makeMaps();

  RawCameras raw_;
  std::array<cv::Matx33d, 2> rotations_;
  StereoCamera camera_;
  Eigen::Isometry3d T_body_left_ = Eigen::Isometry3d::Identity();
  cv::Mat map_x_[2], map_y_[2];  ///< raw pixel of each rectified one
};

/// The same camera with this horizontal field of view (deg), equal focal lengths, and the principal point in the
/// middle.
StereoCamera withFieldOfView(StereoCamera camera, double fov);

/// A calibration of two cameras in one of the formats of docs/tools.md. `fov` as above; 0 leaves the projection of a
/// calibration that has one. `size`: of the images, for formats that lack it. Throws std::runtime_error that names the
/// file and these formats.
StereoRectification readCalibration(const std::vector<std::string>& files, double fov = 0.0, cv::Size size = {});

}  // namespace sdvo
