#include "foliage.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace sdvo::render {

void addLeaf(Mesh& mesh, Random& random, const Eigen::Vector3d& at, double half) {
  Eigen::Vector3d normal(random.normal(), random.normal() - 0.6, random.normal());
  normal.normalize();
  const double turn = random.uniform(0.0, 2.0 * M_PI);
  const Eigen::Vector3d a0 = normal.unitOrthogonal(), b0 = normal.cross(a0);
  const Eigen::Vector3d a = half * (std::cos(turn) * a0 + std::sin(turn) * b0);
  const Eigen::Vector3d b = 0.6 * half * (std::cos(turn) * b0 - std::sin(turn) * a0);
  // A rhombus: leaves have tips.
  mesh.addQuad(at - a, at - b, at + a, at + b, Material::kLeaf, random.uniform(0.16, 0.4));
}

void addTuft(Mesh& mesh, Random& random, const Eigen::Vector3d& centre, double radius) {
  constexpr int kRings = 4, kSides = 6;
  Eigen::Vector3d points[kRings + 1][kSides];
  for (int ring = 0; ring <= kRings; ++ring)
    for (int side = 0; side < kSides; ++side) {
      const double polar = M_PI * ring / kRings, around = 2.0 * M_PI * (side + 0.5 * (ring % 2)) / kSides;
      const double r = radius * (ring == 0 || ring == kRings ? 0.9 : random.uniform(0.7, 1.1));
      points[ring][side] = centre + r * Eigen::Vector3d(std::sin(polar) * std::cos(around), -std::cos(polar),
                                                        std::sin(polar) * std::sin(around));
    }
  const double albedo = random.uniform(0.7, 1.1), s0 = random.uniform(0.0, 9.0), t0 = random.uniform(0.0, 9.0);
  for (int ring = 0; ring < kRings; ++ring)
    for (int side = 0; side < kSides; ++side)
      mesh.addQuad(points[ring][side], points[ring][(side + 1) % kSides], points[ring + 1][(side + 1) % kSides],
                   points[ring + 1][side], Material::kFoliage, albedo, s0 + radius * side, t0 + radius * ring);
}

}  // namespace sdvo::render
