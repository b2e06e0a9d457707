#include <algorithm>
#include <stdexcept>

#include "corridor_plan.hpp"
#include "random.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

using Vector3 = Eigen::Vector3d;

constexpr double kFloor = 0.6, kCeiling = -1.9;  // y; the camera is at 0, m
constexpr double kHalfWidth = 0.5 * CorridorPlan::kWidth;
constexpr double kAhead = 25.0;      // of corridor beyond the path, m
constexpr double kClearance = 0.25;  // between the path and a wall, m

Vector3 onFloor(const Eigen::Vector2d& plan) {
  return {plan.x(), kFloor, plan.y()};
}

/// One wall of a straight stretch, seen from inside: where it begins on the floor, and where it leads.
struct Wall {
  Vector3 begin, along, inwards;
  double length;

  Vector3 at(double way, double height, double off = 0.0) const {
    return begin + way * along + height * kUp + off * inwards;
  }
};

/// A box on the wall, from `way` and `height` on; `thick` m off it.
void addOn(const Wall& wall, double way, double height, double width, double tall, double thick, Material material,
           double albedo, Mesh& mesh) {
  mesh.addBox(wall.at(way + 0.5 * width, height + 0.5 * tall, 0.5 * thick), 0.5 * width * wall.along, 0.5 * tall * kUp,
              0.5 * thick * wall.inwards, material, albedo);
}

void addDoor(const Wall& wall, double way, Random& random, Mesh& mesh) {
  constexpr double kWidth = 0.9, kTall = 2.05, kFrame = 0.07, kThick = 0.04;
  const double frame = random.uniform(0.25, 0.5), leaf = random.uniform(0.5, 1.0);
  addOn(wall, way, 0.0, kWidth, kTall, 0.015, Material::kBark, leaf, mesh);
  addOn(wall, way - kFrame, 0.0, kFrame, kTall + kFrame, kThick, Material::kFlat, frame, mesh);
  addOn(wall, way + kWidth, 0.0, kFrame, kTall + kFrame, kThick, Material::kFlat, frame, mesh);
  addOn(wall, way, kTall, kWidth, kFrame, kThick, Material::kFlat, frame, mesh);
  addOn(wall, way + 0.08, 1.0, 0.13, 0.025, 0.06, Material::kFlat, 0.15, mesh);             // handle
  addOn(wall, way + kWidth + 0.15, 1.45, 0.16, 0.12, 0.006, Material::kPoster, 1.0, mesh);  // name plate
}

/// Skirting, doors, and what hangs between them; the wall itself is plain.
void addWall(const Wall& wall, Random& random, Mesh& mesh) {
  mesh.addPanel(wall.at(0.0, 0.0), wall.length * wall.along, (kFloor - kCeiling) * kUp, Material::kPlaster, 1.0,
                random.uniform(0.0, 2.5), random.uniform(0.0, 2.5));
  addOn(wall, 0.0, 0.0, wall.length, 0.09, 0.015, Material::kFlat, 0.3, mesh);
  for (double way = random.uniform(0.6, 1.5); way + 1.2 < wall.length; way += random.uniform(2.2, 3.6)) {
    addDoor(wall, way, random, mesh);
    const double beside = way + random.uniform(1.35, 1.6);
    if (beside + 1.0 > wall.length) continue;
    if (random.chance(0.35))
      addOn(wall, beside, random.uniform(0.9, 1.2), random.uniform(0.4, 0.8), random.uniform(0.4, 0.7), 0.02,
            Material::kPoster, random.uniform(0.7, 1.1), mesh);
    else if (random.chance(0.4))
      mesh.addTube(wall.at(beside, 0.9, 0.1), wall.at(beside, 1.45, 0.1), 0.08, 0.08, 12, Material::kFlat,
                   0.2);  // extinguisher
    else if (random.chance(0.5))
      addOn(wall, beside, 1.05, 0.08, 0.08, 0.012, Material::kFlat, 0.45, mesh);  // switch
  }
}

/// Floor and ceiling of a rectangle, the lamps along its middle.
void addStretch(const Eigen::Vector2d& begin, const Eigen::Vector2d& direction, double length, Mesh& mesh) {
  const Eigen::Vector2d right(direction.y(), -direction.x());
  const Vector3 along(direction.x(), 0.0, direction.y()), across(right.x(), 0.0, right.y());
  const Vector3 corner = onFloor(begin - kHalfWidth * right);
  const Vector3 to_ceiling = (kFloor - kCeiling) * kUp;
  mesh.addPanel(corner, 2.0 * kHalfWidth * across, length * along, Material::kPlaster, 0.55, begin.x(), begin.y());
  mesh.addPanel(corner + to_ceiling, 2.0 * kHalfWidth * across, length * along, Material::kPlaster, 0.9, begin.y(),
                begin.x());
  for (double way = 0.8; way + 0.6 < length; way += 2.4)
    mesh.addBox(onFloor(begin) + way * along + to_ceiling - 0.03 * kUp, 0.6 * along, 0.09 * across, 0.03 * kUp,
                Material::kFlat, 1.2);
}

/// The distance of a place to the middle line.
double offMiddle(const CorridorPlan& plan, int corners, const Eigen::Vector2d& place) {
  double least = 1e9;
  for (int i = 0; i < corners; ++i) {
    const Eigen::Vector2d offset = place - plan.corner(i), direction = plan.direction(i);
    const double along = std::clamp(offset.dot(direction), 0.0, plan.length(i));
    least = std::min(least, (offset - along * direction).norm());
  }
  return least;
}

}  // namespace

World makeCorridorWorld(const DrivePath& path, std::uint64_t seed) {
  const CorridorPlan plan(seed);
  const double needed = path.distanceAt((path.count() - 1) / path.rate()) + kAhead;
  int stretches = 0;
  for (double length = 0.0; length < needed; ++stretches) length += plan.length(stretches);

  for (const Eigen::Isometry3d& pose : path.poses()) {
    const Vector3 at = pose.translation();
    if (offMiddle(plan, stretches, {at.x(), at.z()}) > kHalfWidth - kClearance || at.y() > kFloor - kClearance ||
        at.y() < kCeiling + kClearance)
      throw std::invalid_argument("the trajectory leaves the corridor: --world corridor is for --trajectory corridor");
  }

  World world;
  Mesh& mesh = world.mesh;
  Random random(seed, 95);
  for (int i = 0; i < stretches; ++i) {
    const Eigen::Vector2d direction = plan.direction(i), right(direction.y(), -direction.x());
    // Stretches share the square of a corner: each begins where the last one's square ends.
    const double from = i == 0 ? 0.0 : kHalfWidth, to = plan.length(i) + kHalfWidth;
    addStretch(plan.corner(i) + from * direction, direction, to - from, mesh);
    for (const int side : {-1, 1}) {
      // At a corner the wall on the inner side is shorter and that on the outer side longer by half the width.
      const double begin = i == 0 ? 0.0 : side * plan.turn(i) * kHalfWidth;
      const double end = plan.length(i) - side * plan.turn(i + 1) * kHalfWidth;
      const Eigen::Vector2d foot = plan.corner(i) + begin * direction + side * kHalfWidth * right;
      addWall({onFloor(foot),
               {direction.x(), 0.0, direction.y()},
               {-side * right.x(), 0.0, -side * right.y()},
               end - begin},
              random, mesh);
    }
  }
  // Both ends are closed; the far one behind the square of the last corner.
  const Eigen::Vector2d along = plan.direction(stretches - 1);
  const Eigen::Vector2d far_end = plan.corner(stretches) + kHalfWidth * along, near_end = plan.corner(0);
  for (const auto& [end, inwards] :
       {std::pair(near_end, plan.direction(0)), std::pair(far_end, Eigen::Vector2d(-along))}) {
    const Eigen::Vector2d right(inwards.y(), -inwards.x());
    addWall({onFloor(end - 1.5 * kHalfWidth * right),
             {right.x(), 0.0, right.y()},
             {inwards.x(), 0.0, inwards.y()},
             3.0 * kHalfWidth},
            random, mesh);
  }
  world.textures = std::make_shared<TextureSet>(seed);
  world.to_sun.normalize();
  world.ambient = 0.75;
  world.sun = 0.5;
  world.haze_distance = 0.0;
  return world;
}

}  // namespace sdvo::render
