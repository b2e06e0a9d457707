#include "facet.hpp"

#include <array>

namespace sdvo::render {

void Facet::set(const Mesh& mesh, std::uint32_t quad, const Eigen::Isometry3f* T_world_mesh,
                const Eigen::Vector3f& origin, bool second) {
  surface_ = &mesh.surfaces[quad];
  second_ = second;
  std::array<Eigen::Vector3f, 4> corners;
  for (int i = 0; i < 4; ++i) {
    corners[i] = mesh.vertices[mesh.quads[quad][i]];
    if (T_world_mesh) corners[i] = *T_world_mesh * corners[i];
  }
  normal_ = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalized();
  if (!normal_.allFinite()) normal_ = Eigen::Vector3f(0.0f, -1.0f, 0.0f);
  axis_s_ = (corners[1] - corners[0]).normalized();
  axis_t_ = (corners[3] - corners[0]).normalized();

  const Eigen::Vector3f& corner = corners[second ? 2 : 0];
  const Eigen::Vector3f edge_u = corners[second ? 3 : 1] - corner, edge_v = corners[second ? 1 : 3] - corner;
  plane_normal_ = edge_u.cross(edge_v);
  const float scale = 1.0f / plane_normal_.squaredNorm();
  dual_u_ = scale * edge_v.cross(plane_normal_);
  dual_v_ = scale * plane_normal_.cross(edge_u);
  from_corner_ = origin - corner;
}

Facet::Place Facet::meet(const Eigen::Vector3f& direction, const Place& otherwise) const {
  const float depth = -plane_normal_.dot(from_corner_) / plane_normal_.dot(direction);
  const Eigen::Vector3f offset = from_corner_ + depth * direction;
  const float u = dual_u_.dot(offset), v = dual_v_.dot(offset);
  // Not a number, too, when the triangle is a line.
  if (!(depth > 0.0f && u > -1.0f && u < 2.0f && v > -1.0f && v < 2.0f)) return otherwise;
  return second_ ? Place{depth, 1.0f - u, 1.0f - v} : Place{depth, u, v};
}

}  // namespace sdvo::render
