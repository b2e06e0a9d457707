#include "gardens.hpp"

#include "foliage.hpp"

namespace sdvo::render {

namespace {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Axes = BuildingSite::Axes;

void addHedge(BuildingSite& site, Random& random, double s, double length, double lateral) {
  const double height = random.uniform(0.6, 1.5);
  for (double at = s; at < s + length; at += 0.5) {
    const Vector2 p = site.road().beside(at, lateral);
    if (!site.isFree(p, 0.9)) continue;
    const Vector3 foot = site.onGround(p);
    const Axes axes = site.axesAt(at);
    site.mesh().addBox(foot + 0.4 * height * kUp, 0.27 * axes.ahead, 0.25 * axes.right, 0.5 * height * kUp,
                       Material::kFoliage, 0.9);
    for (int leaf = 0; leaf < 36; ++leaf) {
      const Vector3 offset = random.normal() * 0.2 * axes.right + random.uniform(-0.35, 0.35) * axes.ahead +
                             random.uniform(0.0, height) * kUp;
      addLeaf(site.mesh(), random, foot + 1.25 * offset, random.uniform(0.04, 0.09));
    }
  }
}

void addFence(BuildingSite& site, double s, double length, double lateral) {
  for (double at = s; at < s + length; at += 0.16) {
    const Vector2 p = site.road().beside(at, lateral);
    if (!site.isFree(p, 0.7)) continue;
    const Axes axes = site.axesAt(at);
    const Vector3 foot = site.onGround(p);
    site.mesh().addBox(foot + 0.5 * kUp, 0.045 * axes.ahead, 0.012 * axes.right, 0.55 * kUp, Material::kBark, 0.85);
  }
  for (double at = s + 0.5; at + 0.5 < s + length; at += 1.0) {
    const Vector2 p = site.road().beside(at, lateral);
    const Axes axes = site.axesAt(at);
    if (!site.isFree(p, 0.5 * axes.ahead, Vector3::Zero(), 0.7)) continue;
    for (const double rail : {0.3, 0.8})
      site.mesh().addBox(site.onGround(p) + rail * kUp, 0.5 * axes.ahead, 0.02 * axes.right, 0.03 * kUp,
                         Material::kBark, 0.6);
  }
}

void addWall(BuildingSite& site, double s, double length, double lateral) {
  for (double at = s; at < s + length; at += 2.0) {
    const Vector2 p = site.road().beside(at + 1.0, lateral);
    const Axes axes = site.axesAt(at + 1.0);
    if (!site.isFree(p, axes.ahead, Vector3::Zero(), 0.9)) continue;
    site.mesh().addBox(site.onGround(p) + 0.3 * kUp, 1.02 * axes.ahead, 0.12 * axes.right, 0.8 * kUp, Material::kBrick,
                       0.8);
  }
}

}  // namespace

void addGardens(BuildingSite& site, double side, Random random) {
  for (double s = site.start(); s < site.end(); s += 1.0) {
    const double stretch = random.uniform(4.0, 14.0);
    const double kind = random.uniform();
    if (kind < 0.35)
      addHedge(site, random, s, stretch, side * random.uniform(6.6, 9.5));
    else if (kind < 0.6)
      addFence(site, s, stretch, side * random.uniform(6.0, 8.0));
    else if (kind < 0.7)
      addWall(site, s, stretch, side * random.uniform(7.0, 9.0));
    s += stretch + random.uniform(0.0, 8.0);
  }
}

}  // namespace sdvo::render
