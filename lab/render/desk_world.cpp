#include <cmath>
#include <stdexcept>

#include "random.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

using Vector3 = Eigen::Vector3d;

constexpr double kNearest = 0.3, kFarthest = 0.85;  // depth of what stands on the desk and of the wall behind it, m
constexpr double kTextureScale = 0.12;              // prints and grains of small things

const Material kCovers[] = {Material::kPoster, Material::kBark, Material::kConcrete, Material::kBrick};

/// An upright box with its foot at `at`.
void addThing(const Vector3& at, double half_width, double half_depth, double height, double turn, Material material,
              double albedo, Mesh& mesh) {
  const Vector3 a(std::cos(turn), 0.0, std::sin(turn)), b(-std::sin(turn), 0.0, std::cos(turn));
  mesh.addBox(at + 0.5 * height * kUp, half_width * a, 0.5 * height * kUp, half_depth * b, material, albedo);
}

void addKeyboard(const Vector3& at, double turn, Mesh& mesh) {
  const Vector3 a(std::cos(turn), 0.0, std::sin(turn)), b(-std::sin(turn), 0.0, std::cos(turn));
  addThing(at, 0.21, 0.07, 0.012, turn, Material::kFlat, 0.25, mesh);
  for (int row = -2; row <= 2; ++row)
    for (int column = -7; column <= 7; ++column)
      addThing(at + 0.027 * column * a + 0.025 * row * b + 0.012 * kUp, 0.011, 0.0105, 0.006, turn, Material::kPoster,
               0.9, mesh);
}

}  // namespace

World makeDeskWorld(const DrivePath& path, std::uint64_t seed) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Isometry3d& pose : path.poses()) box.extend(pose.translation());
  if (box.sizes().maxCoeff() > 1.0)
    throw std::invalid_argument("the trajectory does not fit over a desk, 1 m: --world desk is for --trajectory desk");
  const double top = box.max().y() + 0.2, ceiling = box.min().y() - 0.9;
  const double front = box.max().z() + kNearest, back = std::max(box.min().z() + kFarthest, front + 0.3);
  const double left = box.min().x() - 0.75, right = box.max().x() + 0.75, near = box.min().z() - 0.4;
  const Vector3 x = Vector3::UnitX(), z = Vector3::UnitZ();

  Random random(seed, 96);
  World world;
  Mesh& mesh = world.mesh;
  mesh.addPanel({left, top, near}, (right - left) * x, (back - near) * z, Material::kBark, 0.8);
  mesh.addPanel({left, ceiling, back}, (right - left) * x, (ceiling - top) * kUp, Material::kConcrete, 1.0);
  for (const double side : {left, right})
    mesh.addPanel({side, ceiling, near}, (back - near) * z, (ceiling - top) * kUp, Material::kConcrete, 0.8);
  mesh.addPanel({left, ceiling, near}, (right - left) * x, (back - near) * z, Material::kPlaster, 1.0);
  mesh.addPanel({left, ceiling, near}, (right - left) * x, (ceiling - top) * kUp, Material::kConcrete, 0.7);

  // Notes and pictures on the wall behind.
  for (int i = 0; i < 22; ++i) {
    const double width = random.uniform(0.05, 0.25), height = random.uniform(0.05, 0.2);
    mesh.addPanel(
        {random.uniform(left, right - width), random.uniform(ceiling + 0.1, top - 0.25), back - 0.002 * (i + 1)},
        width * x, -height * kUp, Material::kPoster, random.uniform(0.5, 1.0), random.uniform(0.0, 1.0),
        random.uniform(0.0, 1.0));
  }
  // A row of books before it, of any height and thickness.
  for (double at = left + 0.05; at < right - 0.1;) {
    const double thick = random.uniform(0.012, 0.05), depth = random.uniform(0.06, 0.09);
    if (random.chance(0.85))
      addThing({at + 0.5 * thick, top, back - 0.11}, 0.48 * thick, depth, random.uniform(0.16, 0.3), 0.0,
               kCovers[random.index(4)], random.uniform(0.3, 1.1), mesh);
    at += thick;
  }
  // Boxes, mugs and pens stand about; no nearer than the nearest allowed.
  for (int i = 0; i < 34; ++i) {
    const double size = random.uniform(0.02, 0.06);
    const Vector3 at(random.uniform(left + 0.1, right - 0.1), top, random.uniform(front + size, back - 0.22));
    if (random.chance(0.35))
      mesh.addTube(at, at + random.uniform(0.06, 0.15) * kUp, 0.6 * size, 0.6 * size, 20, kCovers[random.index(3)],
                   random.uniform(0.4, 1.1));
    else
      addThing(at, size, random.uniform(0.015, 0.04), random.uniform(0.03, 0.18), random.uniform(0.0, M_PI),
               kCovers[random.index(4)], random.uniform(0.3, 1.1), mesh);
  }
  addKeyboard({0.5 * (left + right) + random.uniform(-0.1, 0.1), top, front + 0.02}, random.uniform(-0.15, 0.15), mesh);

  world.textures = std::make_shared<TextureSet>(seed, kTextureScale);
  world.to_sun.normalize();
  world.ambient = 0.75;
  world.sun = 0.7;
  world.haze_distance = 0.0;
  return world;
}

}  // namespace sdvo::render
