#pragma once

#include <Eigen/Core>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// A rectified stereo pair: both views share one pinhole model, the right camera sits `baseline` metres along +x.
/// Frames: left rectified optical frame (x right, y down, z forward). Pixels: (0, 0) is the centre of the top-left one.
struct StereoCamera {
  double fx = 0.0, fy = 0.0;  ///< focal lengths, px
  double cx = 0.0, cy = 0.0;  ///< principal point, px
  double baseline = 0.0;      ///< m
  int width = 0, height = 0;  ///< px

  /// Throws std::invalid_argument naming the first quantity that no camera can have.
  void check() const;

  /// (u_left, v, u_right) in px of a point in metres; the point must lie in front of the camera (z > 0).
  Eigen::Vector3d project(const Eigen::Vector3d& point) const {
    const double inverse_depth = 1.0 / point.z();
    const double u = fx * point.x() * inverse_depth + cx;
    return {u, fy * point.y() * inverse_depth + cy, u - fx * baseline * inverse_depth};
  }

  /// Whether the left image shows a pixel of project().
  bool sees(const Eigen::Vector3d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= width && pixel.y() <= height;
  }

  /// Derivative of project() with respect to the point, px/m.
  Eigen::Matrix3d projectionJacobian(const Eigen::Vector3d& point) const;

  /// Point in metres seen at (u, v) of the left image with a positive disparity (all px).
  Eigen::Vector3d backProject(double u, double v, double disparity) const {
    const double z = depth(disparity);
    return {(u - cx) * z / fx, (v - cy) * z / fy, z};
  }

  double depth(double disparity) const { return fx * baseline / disparity; }
  double disparity(double depth) const { return fx * baseline / depth; }

  /// Depth, m, at which the disparity is the image's width. No point nearer than that is in both images, so a motion
  /// that predicts one is treated as if the point were behind the camera.
  double nearestDepth() const { return depth(width); }

  /// Whether `other` can be this rig after autofocus or a new calibration. The image size must be the same, the other
  /// numbers within 5 %: autofocus changes a focal length by 1 to 4 %.
  bool isLike(const StereoCamera& other) const;

  bool operator==(const StereoCamera& other) const;
  bool operator!=(const StereoCamera& other) const { return !(*this == other); }
};

}  // namespace sdvo
