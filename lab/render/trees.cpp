#include "trees.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "foliage.hpp"

namespace sdvo::render {

namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

/// Young trees are held by these.
void addStakes(Mesh& mesh, const Vector3& foot) {
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.1 * i + 0.3;
    const Vector3 out(std::cos(angle), 0.0, std::sin(angle));
    mesh.addTube(foot + 0.55 * out - 0.4 * kUp, foot + 0.3 * out + 1.9 * kUp, 0.035, 0.035, 6, Material::kBark, 0.75);
  }
}

/// The crown is a heap of tufts: a lumpy core of foliage, with single leaves that stand out from it.
void addCrown(Mesh& mesh, Random& random, const Vector3& fork, double radius, double height, double size, int leaves) {
  const Vector3 heart = fork + 0.7 * height * kUp;
  const int tufts = 13 + random.index(6);
  for (int tuft = 0; tuft < tufts; ++tuft) {
    Vector3 direction(random.normal(), random.normal(), random.normal());
    direction.normalize();
    const double depth = std::cbrt(random.uniform(0.1, 1.0));
    const Vector3 centre =
        heart + 0.85 * depth * Vector3(radius * direction.x(), height * 0.75 * direction.y(), radius * direction.z());
    if (tuft % 3 == 0)
      mesh.addTube(fork + random.uniform(0.0, 0.5) * (heart - fork), centre, 0.03 * size, 0.01 * size, 4,
                   Material::kBark, 0.4);
    const double tuft_radius = radius * random.uniform(0.24, 0.42);
    addTuft(mesh, random, centre, 0.72 * tuft_radius);
    for (int leaf = 0; leaf < leaves / tufts; ++leaf) {
      Vector3 out(random.normal(), random.normal(), random.normal());
      out.normalize();
      addLeaf(mesh, random, centre + tuft_radius * random.uniform(0.7, 1.2) * out, size * random.uniform(0.05, 0.10));
    }
  }
}

void addTree(BuildingSite& site, Random& random, const Vector2& p, double size, int leaves) {
  if (!site.isFree(p, 0.8)) return;
  site.take(p);
  const Vector3 foot = site.onGround(p);
  const double trunk = size * random.uniform(2.0, 2.8), crown_radius = size * random.uniform(1.1, 1.8);
  const double crown_height = size * random.uniform(1.7, 2.6);
  const Vector3 lean(0.05 * random.normal(), 0.0, 0.05 * random.normal());
  const Vector3 fork = foot + trunk * (kUp + lean);
  site.mesh().addTube(foot - 0.4 * kUp, fork, 0.10 * size, 0.07 * size, 8, Material::kBark, 0.55);
  if (size < 1.0 && leaves > 400 && random.chance(0.6)) addStakes(site.mesh(), foot);
  addCrown(site.mesh(), random, fork, crown_radius, crown_height, size, leaves);
}

}  // namespace

void addTrees(BuildingSite& site, double side, Random random) {
  for (double s = site.start(); s < site.end(); s += random.uniform(5.5, 11.0)) {
    if (random.chance(side > 0 ? 0.45 : 0.15)) continue;
    const double lateral = side > 0 ? random.uniform(5.0, 6.4) : random.uniform(7.2, 9.5);
    addTree(site, random, site.road().beside(s, side * lateral), random.uniform(0.75, 1.25), 520);
  }
  for (double s = site.start(); s < site.end(); s += random.uniform(4.0, 12.0))
    addTree(site, random, site.road().beside(s, side * random.uniform(13.0, 60.0)), random.uniform(1.1, 2.2), 90);
}

void addWood(BuildingSite& site, Random random) {
  const GroundMap& ground = site.ground();
  const float level = static_cast<float>(GroundMap::kReach - 6.0);
  constexpr int kStride = 4;
  for (int row = 0; row + kStride < ground.rows(); row += kStride)
    for (int column = 0; column + kStride < ground.columns(); column += kStride) {
      std::vector<Vector2> crossings;
      const int corners[5][2] = {{0, 0}, {0, kStride}, {kStride, kStride}, {kStride, 0}, {0, 0}};
      for (int edge = 0; edge < 4; ++edge) {
        const int r0 = row + corners[edge][0], c0 = column + corners[edge][1];
        const int r1 = row + corners[edge + 1][0], c1 = column + corners[edge + 1][1];
        const float d0 = std::min(ground.node(r0, c0).path, 99.0f) - level;
        const float d1 = std::min(ground.node(r1, c1).path, 99.0f) - level;
        if ((d0 < 0.0f) == (d1 < 0.0f)) continue;
        const double share = d0 / (d0 - d1);
        crossings.push_back((1.0 - share) * ground.position(r0, c0) + share * ground.position(r1, c1));
      }
      if (crossings.size() < 2) continue;
      const Vector3 a = site.onGround(crossings[0]) - 4.0 * kUp, b = site.onGround(crossings[1]) - 4.0 * kUp;
      const double height = random.uniform(12.0, 17.0);
      site.mesh().addQuad(a + height * kUp, b + (height + random.uniform(-1.5, 1.5)) * kUp, b, a, Material::kFoliage,
                          0.5, a.x() + a.z());
      for (int leaf = 0; leaf < 60; ++leaf)
        addLeaf(site.mesh(), random, a + random.uniform() * (b - a) + (height + random.normal() * 0.9) * kUp,
                random.uniform(0.2, 0.6));
    }
}

}  // namespace sdvo::render
