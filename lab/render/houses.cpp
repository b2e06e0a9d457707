#include "houses.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo::render {

namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Axes = BuildingSite::Axes;

/// What the parts of one house have in common.
struct House {
  Axes axes;
  double side;          // of the way: 1 right, -1 left
  double length;        // along the road, m
  Vector3 base;         // the middle of the ground floor
  Vector3 along, back;  // halves of its edges: parallel to the road, away from it
  double height;        // to the eaves, m
  double albedo;

  Vector3 top() const { return base + height * kUp; }
  Vector3 front() const { return base - back; }
};

void addWalls(Mesh& mesh, Random& random, const House& house) {
  const int style = random.chance(0.4) ? 3 * random.index(2) : random.index(kFacadeCount);
  const auto material = static_cast<Material>(static_cast<int>(Material::kFacade) + style);
  const double foundation = 1.5;  // walls reach into the ground where it slopes
  const Vector3 down(0.0, house.height + foundation, 0.0), top = house.top();
  const double s0 = 3.2 * random.index(4), t0 = -std::fmod(house.height, 3.2) + 3.2 * random.index(4) + 12.8;
  mesh.addPanel(top - house.along - house.back, 2.0 * house.along, down, material, house.albedo, s0, t0);
  mesh.addPanel(top - house.along + house.back, 2.0 * house.along, down, material, house.albedo, s0, t0);
  mesh.addPanel(top - house.along - house.back, 2.0 * house.back, down, material, house.albedo, s0 + 1.2, t0);
  mesh.addPanel(top + house.along - house.back, 2.0 * house.back, down, material, house.albedo, s0 + 1.2, t0);
}

/// Gable along the street with eaves, or flat with an attic.
void addRoof(Mesh& mesh, Random& random, const House& house) {
  const Vector3 &along = house.along, &back = house.back, top = house.top();
  const double overhang = 1.06;
  if (!random.chance(0.7)) {
    mesh.addBox(top + 0.1 * kUp, overhang * along, overhang * back, 0.2 * kUp, Material::kConcrete, 0.5);
    return;
  }
  const Vector3 ridge = random.uniform(2.0, 3.8) * kUp;
  const double tiles = random.uniform(0.25, 0.55);
  for (const double slope : {-1.0, 1.0}) {
    const Vector3 eaves = top + slope * overhang * back - 0.06 * ridge;
    mesh.addQuad(eaves - overhang * along, eaves + overhang * along, top + overhang * along + ridge,
                 top - overhang * along + ridge, Material::kRoof, tiles);
  }
  for (const double end : {-1.0, 1.0})
    mesh.addQuad(top + end * along - back, top + end * along + back, top + end * along + ridge,
                 top + end * along + ridge, Material::kConcrete, house.albedo);
  mesh.addBox(top + 0.4 * along + ridge, 0.3 * house.axes.ahead, 0.3 * house.axes.right, 0.7 * kUp, Material::kBrick,
              0.6);
}

void addBalcony(Mesh& mesh, const Vector3& at, const Axes& axes, double side) {
  const Vector3 out = -0.55 * side * axes.right, along = 1.1 * axes.ahead;
  mesh.addBox(at + out, along, 0.55 * axes.right, 0.07 * kUp, Material::kConcrete, 0.8);
  for (double x = -1.0; x <= 1.01; x += 0.125)
    mesh.addTube(at + 2.0 * out + x * along, at + 2.0 * out + x * along + 0.95 * kUp, 0.014, 0.014, 4, Material::kFlat,
                 0.25);
  mesh.addBox(at + 2.0 * out + 0.97 * kUp, along, 0.03 * axes.right, 0.03 * kUp, Material::kFlat, 0.3);
}

void addScaffolding(Mesh& mesh, const Vector3& front, const Vector3& along, const Vector3& half_width, double height) {
  const int bays = std::max(2, static_cast<int>(along.norm() * 2.0 / 2.4));
  for (const double row : {-1.0, 1.0}) {
    for (int bay = 0; bay <= bays; ++bay) {
      const Vector3 foot = front + row * half_width + (2.0 * bay / bays - 1.0) * along;
      mesh.addTube(foot - 0.5 * kUp, foot + (height + 0.8) * kUp, 0.03, 0.03, 5, Material::kFlat, 0.5);
      if (row < 0.0 && bay < bays && bay % 2 == 0)
        mesh.addTube(foot, foot + 2.0 / bays * along + 2.0 * kUp, 0.025, 0.025, 5, Material::kFlat, 0.45);
    }
    for (double level = 2.0; level < height + 0.6; level += 2.0)
      for (const double rail : {0.0, 0.5, 1.0}) {
        const Vector3 at = front + row * half_width + (level + rail) * kUp;
        mesh.addTube(at - along, at + along, 0.022, 0.022, 4, Material::kFlat, 0.55);
      }
  }
  for (double level = 2.0; level < height + 0.6; level += 2.0)
    mesh.addBox(front + level * kUp, along, half_width, 0.025 * kUp, Material::kBark, 0.7);
}

/// A plinth, balconies or scaffolding give the front relief.
void addRelief(Mesh& mesh, Random& random, const House& house) {
  const Vector3 front = house.front(), &along = house.along;
  const Axes& axes = house.axes;
  const double side = house.side, height = house.height;
  mesh.addBox(front + 0.1 * kUp, along, 0.04 * axes.right, 0.5 * kUp, Material::kConcrete, 0.45);
  if (random.chance(0.14)) {
    addScaffolding(mesh, front - 0.8 * side * axes.right, along, 0.45 * side * axes.right, height);
  } else if (random.chance(0.35)) {
    for (double at = -0.8; at < 0.85; at += 3.2 / house.length * 2.0)
      for (double level = 2.6; level < height - 2.0; level += 3.2)
        if (random.chance(0.6)) addBalcony(mesh, front + at * along + level * kUp, axes, side);
  }
}

/// Its front `setback` m beside the way; returns whether there was place for it.
bool addHouse(BuildingSite& site, Random& random, double s, double side, double setback, double length, double depth) {
  House house;
  house.axes = site.axesAt(s);
  house.side = side;
  house.length = length;
  house.along = 0.5 * length * house.axes.ahead;
  house.back = 0.5 * depth * side * house.axes.right;
  const Vector2 centre = site.road().beside(s, side * (setback + 0.5 * depth));
  if (!site.isFree(centre, house.along, house.back, 1.8)) return false;
  site.take(centre, house.along, house.back);
  house.base = site.onGround(centre);
  house.height = random.uniform(5.5, 12.5);
  house.albedo = random.uniform(0.75, 1.05);
  addWalls(site.mesh(), random, house);
  addRoof(site.mesh(), random, house);
  addRelief(site.mesh(), random, house);
  return true;
}

}  // namespace

void addHouses(BuildingSite& site, double side, Random random) {
  double s = site.start() + random.uniform(0.0, 10.0);
  while (s < site.end()) {
    if (random.chance(side > 0 ? 0.12 : 0.35)) {
      s += random.uniform(6.0, 22.0);
      continue;
    }
    const double length = random.uniform(10.0, 24.0), depth = random.uniform(8.0, 11.0);
    double setback = side > 0 ? random.uniform(7.5, 12.0) : random.uniform(12.0, 19.0);
    // In bends the ends of a house would reach the road: move it back until it fits.
    for (int attempt = 0; attempt < 3; ++attempt, setback += 3.5)
      if (addHouse(site, random, s + 0.5 * length, side, setback, length, depth)) break;
    s += length + random.uniform(0.5, 6.0);
  }
}

void addSecondRow(BuildingSite& site, double side, Random random) {
  for (double s = site.start(); s < site.end();) {
    const double length = random.uniform(10.0, 24.0);
    addHouse(site, random, s + 0.5 * length, side, random.uniform(30.0, 50.0), length, 10.0);
    s += length + random.uniform(2.0, 16.0);
  }
}

}  // namespace sdvo::render
