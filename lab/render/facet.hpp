#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "mesh.hpp"

namespace sdvo::render {

/// One quadrilateral as the camera sees it: its orientation for shading, and the plane of one of its two triangles to
/// find where the ray through any place of the image meets it.
class Facet {
 public:
  /// Place of a ray on the quadrilateral.
  struct Place {
    float depth;  ///< ray parameter, m
    float u, v;   ///< 0 … 1
  };

  /// `T_world_mesh` is that of the mesh; `origin` of the rays in the world. The quadrilateral a b c d consists of the
  /// triangles a b d (u + v ≤ 1) and c d b, as Embree's do; `second` says which one is meant.
  void set(const Mesh& mesh, std::uint32_t quad, const Eigen::Isometry3f* T_world_mesh, const Eigen::Vector3f& origin,
           bool second);

  /// Where a ray with this direction meets the triangle's plane; `otherwise` when that is behind the camera, or the
  /// triangle has no plane.
  Place meet(const Eigen::Vector3f& direction, const Place& otherwise) const;

  const Surface& surface() const { return *surface_; }
  const Eigen::Vector3f& normal() const { return normal_; }
  const Eigen::Vector3f& axisS() const { return axis_s_; }
  const Eigen::Vector3f& axisT() const { return axis_t_; }

 private:
  const Surface* surface_ = nullptr;
  Eigen::Vector3f normal_, axis_s_, axis_t_;  // unit
  Eigen::Vector3f plane_normal_;              // of the triangle, any length
  Eigen::Vector3f dual_u_, dual_v_;           // of the triangle's edges
  Eigen::Vector3f from_corner_;               // to the origin of the rays
  bool second_ = false;
};

}  // namespace sdvo::render
