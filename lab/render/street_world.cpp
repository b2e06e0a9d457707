#include <memory>

#include "building_site.hpp"
#include "gardens.hpp"
#include "houses.hpp"
#include "random.hpp"
#include "street_furniture.hpp"
#include "trees.hpp"
#include "vehicles.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;

constexpr double kCameraHeight = 1.65;  // KITTI's, m

void addGround(BuildingSite& site) {
  const GroundMap& ground = site.ground();
  for (int row = 0; row + 1 < ground.rows(); ++row)
    for (int column = 0; column + 1 < ground.columns(); ++column) {
      if (ground.node(row, column).path > GroundMap::kReach) continue;
      const auto corner = [&](int r, int c) -> Vector3 {
        const Vector2 p = ground.position(r, c);
        return {p.x(), ground.node(r, c).height, p.y()};
      };
      site.mesh().addQuad(corner(row, column), corner(row, column + 1), corner(row + 1, column + 1),
                          corner(row + 1, column), Material::kGround, 1.0);
    }
}

void addKerbs(BuildingSite& site, Random random) {
  for (const double lateral : {GroundMap::kRoadHalfWidth - GroundMap::kRoadOffset + 0.1,
                               -GroundMap::kRoadHalfWidth - GroundMap::kRoadOffset - 0.1})
    for (double s = site.start(); s < site.end() - 1.0; s += 1.0) {
      const Vector2 a = site.road().beside(s, lateral), b = site.road().beside(s + 0.985, lateral);
      const Vector2 middle = 0.5 * (a + b);
      if (site.ground().roadDistance(middle.x(), middle.y()) < GroundMap::kRoadHalfWidth - 0.15) continue;
      const Vector3 from = site.onGround(a), to = site.onGround(b), half = 0.5 * (to - from);
      site.mesh().addBox(0.5 * (from + to) + 0.03 * kUp, half, 0.08 * site.axesAt(s).right, 0.09 * kUp,
                         Material::kConcrete, random.uniform(0.65, 0.9));
    }
}

void addParkedCars(BuildingSite& site, double side, Random random) {
  // Right: a bay at the edge of the road, left: beyond the oncoming lane. Both keep clear of either lane anywhere.
  const double lateral = side > 0 ? 4.75 : -7.6;
  for (double s = site.start(); s < site.end(); s += 6.2) {
    if (!random.chance(side > 0 ? 0.34 : 0.22)) continue;
    const Vector2 p = site.road().beside(s, lateral);
    const BuildingSite::Axes axes = site.axesAt(s);
    if (!site.isFree(p, 2.2 * axes.ahead, 0.8 * axes.right, 0.15)) continue;
    site.take(p, 2.2 * axes.ahead, 0.8 * axes.right);
    const Vector3 ahead = random.chance(side > 0 ? 0.8 : 0.3) ? axes.ahead : Vector3(-axes.ahead);
    const Vector2 metre(ahead.x(), ahead.z());
    site.mesh().append(makeCar(random.index(kCarModels), random.uniform(), random.bits()),
                       placeCar(site.onGround(p), ahead, site.onGround(p + metre) - site.onGround(p - metre)));
  }
}

}  // namespace

World makeStreetWorld(const DrivePath& path, std::uint64_t seed) {
  World world;
  world.road = std::make_shared<RoadLine>(path, kCameraHeight);
  world.ground = std::make_shared<GroundMap>(*world.road);
  world.textures = std::make_shared<TextureSet>(seed);
  world.to_sun.normalize();

  // Every part draws from a stream of random numbers of its own: a change of one leaves the looks of the others.
  BuildingSite site(*world.road, *world.ground, world.mesh);
  addGround(site);
  addKerbs(site, Random(seed, 30));
  for (const double side : {1.0, -1.0}) {
    const auto random = [&](std::uint64_t right) { return Random(seed, side > 0 ? right : right + 1); };
    addHouses(site, side, random(31));
    addSecondRow(site, side, random(33));
    addTrees(site, side, random(35));
    addGardens(site, side, random(37));
    addStreetFurniture(site, side, random(39));
    addParkedCars(site, side, random(41));
  }
  addWood(site, Random(seed, 43));
  return world;
}

}  // namespace sdvo::render
