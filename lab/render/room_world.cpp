#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "random.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

constexpr double kClearance = 0.75;  // between the path and anything solid, m

}  // namespace

World makeRoomWorld(const DrivePath& path, std::uint64_t seed) {
  using Vector3 = Eigen::Vector3d;
  Vector3 low = path.pose(0).translation(), high = low;
  for (const Eigen::Isometry3d& pose : path.poses()) {
    low = low.cwiseMin(pose.translation());
    high = high.cwiseMax(pose.translation());
  }
  if ((high - low).maxCoeff() > 60.0)
    throw std::invalid_argument("the trajectory is longer than 60 m and does not fit into a room: use --world street");
  const double floor = high.y() + 1.3, ceiling = low.y() - 2.6, tall = floor - ceiling;
  low -= Vector3(3.5, 0.0, 3.0);
  high += Vector3(3.5, 0.0, 6.0);
  const double wide = high.x() - low.x(), deep = high.z() - low.z();

  Random random(seed, 80);
  World world;
  Mesh& mesh = world.mesh;
  const Vector3 x = Vector3::UnitX(), z = Vector3::UnitZ();
  mesh.addPanel({low.x(), floor, low.z()}, wide * x, deep * z, Material::kPaving, 0.75);
  mesh.addPanel({low.x(), ceiling, low.z()}, wide * x, deep * z, Material::kConcrete, 0.6);
  mesh.addPanel({low.x(), ceiling, high.z()}, wide * x, -tall * kUp, Material::kBrick, 0.8);
  mesh.addPanel({low.x(), ceiling, low.z()}, wide * x, -tall * kUp, Material::kBrick, 0.7);
  mesh.addPanel({low.x(), ceiling, low.z()}, deep * z, -tall * kUp, Material::kFacade, 0.7);
  mesh.addPanel({high.x(), ceiling, low.z()}, deep * z, -tall * kUp, Material::kConcrete, 0.9);

  const auto isFree = [&](const Vector3& at, double radius) {
    return std::all_of(path.poses().begin(), path.poses().end(), [&](const Eigen::Isometry3d& pose) {
      const Vector3 offset = pose.translation() - at;
      return std::hypot(offset.x(), offset.z()) > radius + kClearance;
    });
  };
  // Posters and panels on the walls, a hand's breadth in front of them.
  for (int i = 0; i < 26; ++i) {
    const double width = random.uniform(0.4, 1.4), height = random.uniform(0.3, 1.1);
    const double y = random.uniform(ceiling + 0.3, floor - 1.6), gap = random.uniform(0.02, 0.15);
    const double s = random.uniform(0.0, 4.0), t = random.uniform(0.0, 4.0), albedo = random.uniform(0.5, 1.0);
    const double along_x = random.uniform(low.x() + 0.3, high.x() - 1.7),
                 along_z = random.uniform(low.z() + 0.3, high.z() - 1.7);
    const int wall = random.index(4);
    const Vector3 corner = wall == 0   ? Vector3(along_x, y, high.z() - gap)
                           : wall == 1 ? Vector3(low.x() + gap, y, along_z)
                           : wall == 2 ? Vector3(high.x() - gap, y, along_z)
                                       : Vector3(along_x, y, low.z() + gap);
    mesh.addPanel(corner, width * (wall == 0 || wall == 3 ? x : z), -height * kUp, Material::kPoster, albedo, s, t);
  }
  // Pipes along walls and ceiling, beams across.
  for (int i = 0; i < 14; ++i) {
    const double radius = random.uniform(0.03, 0.14), y = random.uniform(ceiling + 0.2, ceiling + 1.2);
    const double at = random.uniform(low.z() + 0.3, high.z() - 0.3);
    if (random.chance(0.5))
      mesh.addTube({low.x(), y, at}, {high.x(), y, at}, radius, radius, 12, Material::kConcrete,
                   random.uniform(0.4, 1.1));
    else
      mesh.addTube({random.uniform(low.x(), high.x()), ceiling, high.z() - 0.2},
                   {random.uniform(low.x(), high.x()), floor, high.z() - 0.2}, radius, radius, 12, Material::kBark,
                   random.uniform(0.5, 1.0));
  }
  for (double at = low.z() + 1.0; at < high.z(); at += 2.2)
    mesh.addBox({0.5 * (low.x() + high.x()), ceiling + 0.15, at}, 0.5 * wide * x, 0.15 * kUp, 0.08 * z, Material::kBark,
                0.5);
  // Crates, shelves and posts on the floor.
  const Material crates[] = {Material::kBark, Material::kConcrete, Material::kPoster, Material::kBrick};
  for (int i = 0; i < 46; ++i) {
    const double half_width = random.uniform(0.15, 0.6), half_depth = random.uniform(0.15, 0.5);
    const double height = random.uniform(0.3, 2.0), turn = random.uniform(0.0, M_PI);
    const Vector3 at(random.uniform(low.x() + 0.8, high.x() - 0.8), floor,
                     random.uniform(low.z() + 0.8, high.z() - 0.8));
    if (!isFree(at, std::hypot(half_width, half_depth))) continue;
    const Vector3 a(std::cos(turn), 0.0, std::sin(turn)), b(-std::sin(turn), 0.0, std::cos(turn));
    if (random.chance(0.3)) {  // shelf
      for (double level = 0.1; level < 2.2; level += 0.5)
        mesh.addBox(at + level * kUp, 0.7 * a, 0.02 * kUp, 0.25 * b, Material::kBark, 0.7);
      for (const double side : {-0.68, 0.68})
        for (const double end : {-0.24, 0.24})
          mesh.addTube(at + side * a + end * b, at + side * a + end * b + 2.2 * kUp, 0.025, 0.025, 6, Material::kFlat,
                       0.5);
      for (int box = 0; box < 9; ++box)
        mesh.addBox(at + random.uniform(-0.55, 0.55) * a + (0.22 + 0.5 * random.index(4)) * kUp,
                    random.uniform(0.06, 0.14) * a, 0.1 * kUp, random.uniform(0.06, 0.2) * b, crates[random.index(4)],
                    random.uniform(0.3, 1.1));
    } else {
      mesh.addBox(at + 0.5 * height * kUp, half_width * a, 0.5 * height * kUp, half_depth * b, crates[random.index(4)],
                  random.uniform(0.3, 1.1));
    }
  }
  world.textures = std::make_shared<TextureSet>(seed);
  world.to_sun.normalize();
  world.ambient = 0.75;
  world.sun = 0.7;
  world.haze_distance = 0.0;
  return world;
}

}  // namespace sdvo::render
