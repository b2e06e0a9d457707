#pragma once

#include <Eigen/Core>

#include "world.hpp"

namespace sdvo::render {

/// One place to shade: where a pixel's ray meets a quadrilateral. All vectors in the world frame.
struct ShadingPoint {
  Eigen::Vector3f position;
  Eigen::Vector3f direction;                 ///< of the ray, scaled so that depth = ray parameter
  Eigen::Vector3f direction_x, direction_y;  ///< its change per pixel to the right and down
  Eigen::Vector3f normal;                    ///< unit, of the quadrilateral's front
  Eigen::Vector3f axis_s, axis_t;            ///< unit, of the texture
  float depth = 0.0f;                        ///< m
  float u = 0.0f, v = 0.0f;                  ///< place within the quadrilateral, 0 … 1
};

/// Brightness of matte surfaces: reflectance (filtered over the pixel) times irradiance, then haze. It depends on the
/// place alone and not on the view, up to the filter and the haze, so that all views agree.
class Shader {
 public:
  explicit Shader(const World& world) : world_(&world) {}

  /// 1 is white; may exceed 1.
  float shade(const Surface& surface, const ShadingPoint& point) const;
  /// The same for a leaf, which needs no more than the place along it (`u`, 0 … 1).
  float leaf(const Surface& surface, float u, float depth) const;
  float sky(const Eigen::Vector3f& direction) const;

 private:
  float throughHaze(float brightness, float depth) const;
  float ground(const ShadingPoint& point, const Eigen::Vector3f& step_x, const Eigen::Vector3f& step_y) const;

  const World* world_;
};

}  // namespace sdvo::render
