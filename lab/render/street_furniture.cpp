#include "street_furniture.hpp"

namespace sdvo::render {

namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Axes = BuildingSite::Axes;

void addLamp(BuildingSite& site, double s, double side) {
  const Vector2 p = site.road().beside(s, side > 0 ? 4.9 : -6.2);
  if (!site.isFree(p, 0.5)) return;
  const Vector3 foot = site.onGround(p), top = foot + 5.5 * kUp;
  const Axes axes = site.axesAt(s);
  Mesh& mesh = site.mesh();
  mesh.addTube(foot - 0.4 * kUp, foot + 1.2 * kUp, 0.08, 0.08, 9, Material::kConcrete, 0.35);
  mesh.addTube(foot + 1.2 * kUp, top, 0.055, 0.04, 9, Material::kFlat, 0.22);
  mesh.addTube(top, top - side * 1.0 * axes.right + 0.25 * kUp, 0.035, 0.03, 7, Material::kFlat, 0.22);
  mesh.addBox(top - side * 1.1 * axes.right + 0.27 * kUp, 0.12 * axes.ahead, 0.35 * axes.right, 0.06 * kUp,
              Material::kFlat, 0.3);
}

void addSign(BuildingSite& site, Random& random, double s, double side) {
  const double lateral = side * (side > 0 ? 4.4 : 6.4);
  const Vector2 p = site.road().beside(s, lateral);
  if (!site.isFree(p, 0.45)) return;
  const Vector3 foot = site.onGround(p);
  const Axes axes = site.axesAt(s);
  const double height = random.uniform(2.2, 2.9);
  site.mesh().addTube(foot - 0.4 * kUp, foot + height * kUp, 0.035, 0.035, 7, Material::kFlat, 0.5);
  const double half = random.uniform(0.25, 0.4);
  site.mesh().addPanel(foot + height * kUp - half * axes.right - 0.05 * axes.ahead, 2.0 * half * axes.right,
                       -2.0 * half * kUp, Material::kPoster, 0.95, random.uniform(0.0, 4.0), random.uniform(0.0, 4.0));
}

void addBillboard(BuildingSite& site, Random& random, double s, double side) {
  const Vector2 p = site.road().beside(s, side * (side > 0 ? 6.2 : 9.5));
  const Axes axes = site.axesAt(s);
  const Vector3 across = (axes.right + side * 0.25 * axes.ahead).normalized();
  if (!site.isFree(p, 1.3 * across, Vector3::Zero(), 0.5)) return;
  site.take(p, 1.3 * across, Vector3::Zero());
  const Vector3 foot = site.onGround(p);
  for (const double leg : {-0.8, 0.8})
    site.mesh().addBox(foot + leg * across + 0.6 * kUp, 0.06 * axes.ahead, 0.06 * axes.right, 1.2 * kUp,
                       Material::kConcrete, 0.5);
  site.mesh().addPanel(foot + 3.4 * kUp - 1.2 * across - 0.08 * axes.ahead, 2.4 * across, -2.2 * kUp, Material::kPoster,
                       1.0, 4.0 * random.uniform(), 4.0 * random.uniform());
}

}  // namespace

void addStreetFurniture(BuildingSite& site, double side, Random random) {
  for (double s = site.start(); s < site.end(); s += random.uniform(24.0, 32.0)) addLamp(site, s, side);
  for (double s = site.start() + 9.0; s < site.end(); s += random.uniform(15.0, 45.0)) addSign(site, random, s, side);
  for (double s = site.start() + 30.0; s < site.end(); s += random.uniform(50.0, 110.0))
    addBillboard(site, random, s, side);
}

}  // namespace sdvo::render
