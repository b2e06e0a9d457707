#pragma once

#include <Eigen/Geometry>

#include "finding.hpp"

namespace sdvo {

/// Whether the frame of the left images is an optical one (z ahead). A body's frame (x ahead, z up) in its place makes
/// a robot that drives rise.
class OpticalAxisCheck {
 public:
  /// `translation`: of the camera since the pair before, m, in its own axes.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Vector3d& translation);

  Finding judge() const;

 private:
  double along_axis_ = 0.0, distance_ = 0.0;  ///< m, while the axis points up
};

/// Whether a gyro turns about the axes that the images turn about, with TF's word about its mounting.
class GyroAxesCheck {
 public:
  /// Of one pair, in the camera's axes.
  void add(const Eigen::Matrix3d& by_gyro, const Eigen::Matrix3d& by_images);

  Finding judge() const;

 private:
  double product_ = 0.0, of_gyro_ = 0.0, of_images_ = 0.0;  ///< sums of products and squares, rad^2
  double turned_ = 0.0;                                     ///< rad
};

}  // namespace sdvo
