#pragma once

#include <Eigen/Geometry>

namespace sdvo::render {

/// A pinhole camera somewhere in the world; pixel (0, 0) is the centre of the top-left one.
struct View {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< px
  int width = 0, height = 0;                      ///< px
  Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();

  /// World direction of the ray through a pixel, scaled to depth 1.
  Eigen::Vector3d direction(double u, double v) const {
    return T_world_camera.linear() * Eigen::Vector3d((u - cx) / fx, (v - cy) / fy, 1.0);
  }
};

/// Rays of a view; single precision only at the end.
struct RayBase {
  explicit RayBase(const View& view)
      : origin(view.T_world_camera.translation().cast<float>()),
        corner(view.direction(0.0, 0.0)),
        step_x(view.T_world_camera.linear().col(0) / view.fx),
        step_y(view.T_world_camera.linear().col(1) / view.fy) {}
  Eigen::Vector3f direction(double u, double v) const { return (corner + u * step_x + v * step_y).cast<float>(); }

  Eigen::Vector3f origin;
  Eigen::Vector3d corner, step_x, step_y;
};

}  // namespace sdvo::render
