#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "texture_patterns.hpp"

namespace sdvo::render {

/// Away from the ground in the world frame.
inline const Eigen::Vector3d kUp(0.0, -1.0, 0.0);

/// Look of one quadrilateral. Texture coordinates are metres along its first (s) and last (t) edge from its corner.
struct Surface {
  Material material = Material::kFlat;
  float albedo = 0.5f;  ///< factor on the texture, or the reflectance itself without one
  /// Share of the sun that reaches either side, set by the lighting; of leaves, which shine through and look alike from
  /// both sides, the whole irradiance.
  float sun_front = 1.0f, sun_back = 1.0f;
  float s0 = 0.0f, t0 = 0.0f;
  float length_s = 1.0f, length_t = 1.0f;
};

/// Quadrilaterals with their looks. World frame: that of the first pose, x right, y down, z forward, metres.
struct Mesh {
  using Quad = std::array<std::uint32_t, 4>;

  std::vector<Eigen::Vector3f> vertices;
  std::vector<Quad> quads;
  std::vector<Surface> surfaces;  ///< one per quad

  /// Any four corners in order around the quadrilateral.
  void addQuad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d,
               Material material, double albedo, double s0 = 0.0, double t0 = 0.0);
  /// Parallelogram from a corner and two edges.
  void addPanel(const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_s, const Eigen::Vector3d& edge_t,
                Material material, double albedo, double s0 = 0.0, double t0 = 0.0);
  /// The six sides of a box: its centre and the halves of its three edges.
  void addBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b,
              const Eigen::Vector3d& half_c, Material material, double albedo);
  /// The lateral surface of a cone frustum with the given number of sides.
  void addTube(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_from, double radius_to, int sides,
               Material material, double albedo);
  void append(const Mesh& other, const Eigen::Isometry3d& T_this_other);

  /// Unit normal of the front side, first edge x last edge.
  Eigen::Vector3f normal(std::size_t quad) const;
  Eigen::Vector3f centre(std::size_t quad) const;
};

}  // namespace sdvo::render
