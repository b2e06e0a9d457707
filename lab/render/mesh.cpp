#include "mesh.hpp"

namespace sdvo::render {

void Mesh::addQuad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& d, Material material, double albedo, double s0, double t0) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  for (const Eigen::Vector3d& corner : {a, b, c, d}) vertices.push_back(corner.cast<float>());
  quads.push_back({first, first + 1, first + 2, first + 3});
  Surface surface;
  surface.material = material;
  surface.albedo = static_cast<float>(albedo);
  surface.s0 = static_cast<float>(s0);
  surface.t0 = static_cast<float>(t0);
  surface.length_s = static_cast<float>((b - a).norm());
  surface.length_t = static_cast<float>((d - a).norm());
  surfaces.push_back(surface);
}

void Mesh::addPanel(const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_s, const Eigen::Vector3d& edge_t,
                    Material material, double albedo, double s0, double t0) {
  addQuad(corner, corner + edge_s, corner + edge_s + edge_t, corner + edge_t, material, albedo, s0, t0);
}

void Mesh::addBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_a, const Eigen::Vector3d& half_b,
                  const Eigen::Vector3d& half_c, Material material, double albedo) {
  const std::array<Eigen::Vector3d, 3> half = {half_a, half_b, half_c};
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d& out = half[axis];
    const Eigen::Vector3d& s = half[(axis + 1) % 3];
    const Eigen::Vector3d& t = half[(axis + 2) % 3];
    for (const double side : {-1.0, 1.0})
      addPanel(centre + side * out - s - t, 2.0 * s, 2.0 * t, material, albedo, centre.x() + axis, centre.z() + side);
  }
}

void Mesh::addTube(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_from, double radius_to,
                   int sides, Material material, double albedo) {
  const Eigen::Vector3d axis = (to - from).normalized();
  const Eigen::Vector3d a = axis.unitOrthogonal(), b = axis.cross(a);
  const auto rim = [&](int i) -> Eigen::Vector3d {
    const double angle = 2.0 * M_PI * i / sides;
    return std::cos(angle) * a + std::sin(angle) * b;
  };
  for (int i = 0; i < sides; ++i) {
    const Eigen::Vector3d r0 = rim(i), r1 = rim(i + 1);
    addQuad(from + radius_from * r0, from + radius_from * r1, to + radius_to * r1, to + radius_to * r0, material,
            albedo, 2.0 * radius_from * std::sin(M_PI / sides) * i, 0.0);
  }
}

void Mesh::append(const Mesh& other, const Eigen::Isometry3d& T_this_other) {
  const auto offset = static_cast<std::uint32_t>(vertices.size());
  for (const Eigen::Vector3f& vertex : other.vertices)
    vertices.push_back((T_this_other * vertex.cast<double>()).cast<float>());
  for (const Quad& quad : other.quads)
    quads.push_back({quad[0] + offset, quad[1] + offset, quad[2] + offset, quad[3] + offset});
  surfaces.insert(surfaces.end(), other.surfaces.begin(), other.surfaces.end());
}

Eigen::Vector3f Mesh::normal(std::size_t quad) const {
  const Quad& corners = quads[quad];
  return (vertices[corners[2]] - vertices[corners[0]]).cross(vertices[corners[3]] - vertices[corners[1]]).normalized();
}

Eigen::Vector3f Mesh::centre(std::size_t quad) const {
  const Quad& corners = quads[quad];
  return 0.25f * (vertices[corners[0]] + vertices[corners[1]] + vertices[corners[2]] + vertices[corners[3]]);
}

}  // namespace sdvo::render
