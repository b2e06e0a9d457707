#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "random.hpp"
#include "vehicles.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

constexpr double kCameraHeight = 1.65;  // KITTI's, m
const Eigen::Vector3d kUp(0.0, -1.0, 0.0);

/// Which square metres of the plan are built on.
class Occupancy {
 public:
  bool taken(const Eigen::Vector2d& p) const { return cells_.count(key(p)) > 0; }
  void take(const Eigen::Vector2d& p) { cells_.insert(key(p)); }

 private:
  static std::int64_t key(const Eigen::Vector2d& p) {
    return (static_cast<std::int64_t>(std::floor(p.x())) << 32) ^
           static_cast<std::int64_t>(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(p.y()))));
  }
  std::unordered_set<std::int64_t> cells_;
};

/// Builds the street. Every builder asks first whether its place is free of all parts of the way.
class Street {
 public:
  Street(const DrivePath& path, std::uint64_t seed)
      : seed_(seed),
        road_(std::make_shared<RoadLine>(path, kCameraHeight)),
        ground_(std::make_shared<GroundMap>(*road_)),
        begin_(road_->samples().front().distance),
        end_(road_->samples().back().distance) {}

  World build() {
    addGround();
    addKerbs();
    for (const double side : {1.0, -1.0}) {
      addHouses(side);
      addSecondRow(side);
      addTrees(side);
      addGarden(side);
      addFurniture(side);
      addParkedCars(side);
    }
    addWood();
    World world;
    world.mesh = std::move(mesh_);
    world.textures = std::make_shared<TextureSet>(seed_);
    world.road = road_;
    world.ground = ground_;
    world.to_sun.normalize();
    return world;
  }

 private:
  using Vector2 = Eigen::Vector2d;
  using Vector3 = Eigen::Vector3d;

  /// Local axes of the street at a place: ahead along the way, right of it.
  struct Axes {
    Vector3 ahead, right;
  };
  Axes axesAt(double distance) const {
    const double heading = road_->at(distance).heading;
    return {{std::sin(heading), 0.0, std::cos(heading)}, {std::cos(heading), 0.0, -std::sin(heading)}};
  }
  Vector3 onGround(const Vector2& p) const { return {p.x(), ground_->height(p.x(), p.y()), p.y()}; }

  /// Free of the road by `clearance` metres beyond its edge, within the ground, and not built on.
  bool isFree(const Vector2& p, double clearance) const {
    const GroundMap::Node node = ground_->at(p.x(), p.y());
    return node.road > GroundMap::kRoadHalfWidth + clearance && node.path < GroundMap::kReach - 6.0 &&
           !occupancy_.taken(p);
  }
  /// The same for a rectangle, sampled every metre.
  bool isFree(const Vector2& centre, const Vector2& half_a, const Vector2& half_b, double clearance) const {
    bool free = true;
    forFootprint(centre, half_a, half_b, [&](const Vector2& p) { free = free && isFree(p, clearance); });
    return free;
  }
  void take(const Vector2& centre, const Vector2& half_a, const Vector2& half_b) {
    forFootprint(centre, half_a, half_b, [&](const Vector2& p) { occupancy_.take(p); });
  }
  template <class Visit>
  static void forFootprint(const Vector2& centre, const Vector2& half_a, const Vector2& half_b, const Visit& visit) {
    const int na = static_cast<int>(std::ceil(2.0 * half_a.norm())),
              nb = static_cast<int>(std::ceil(2.0 * half_b.norm()));
    for (int i = 0; i <= na; ++i)
      for (int j = 0; j <= nb; ++j) {
        const double a = na > 0 ? 2.0 * i / na - 1.0 : 0.0, b = nb > 0 ? 2.0 * j / nb - 1.0 : 0.0;
        visit(centre + a * half_a + b * half_b);
      }
  }
  static Vector2 plan(const Vector3& v) { return {v.x(), v.z()}; }

  void addGround() {
    for (int row = 0; row + 1 < ground_->rows(); ++row)
      for (int column = 0; column + 1 < ground_->columns(); ++column) {
        if (ground_->node(row, column).path > GroundMap::kReach) continue;
        const auto corner = [&](int r, int c) -> Vector3 {
          const Vector2 p = ground_->position(r, c);
          return {p.x(), ground_->node(r, c).height, p.y()};
        };
        mesh_.addQuad(corner(row, column), corner(row, column + 1), corner(row + 1, column + 1),
                      corner(row + 1, column), Material::kGround, 1.0);
      }
  }

  void addKerbs() {
    Random random(seed_, 30);
    for (const double lateral : {GroundMap::kRoadHalfWidth - GroundMap::kRoadOffset + 0.1,
                                 -GroundMap::kRoadHalfWidth - GroundMap::kRoadOffset - 0.1})
      for (double s = begin_; s < end_ - 1.0; s += 1.0) {
        const Vector2 a = road_->beside(s, lateral), b = road_->beside(s + 0.985, lateral);
        const Vector2 middle = 0.5 * (a + b);
        if (ground_->roadDistance(middle.x(), middle.y()) < GroundMap::kRoadHalfWidth - 0.15) continue;
        const Vector3 from = onGround(a), to = onGround(b), half = 0.5 * (to - from);
        mesh_.addBox(0.5 * (from + to) + 0.03 * kUp, half, 0.08 * axesAt(s).right, 0.09 * kUp, Material::kConcrete,
                     random.uniform(0.65, 0.9));
      }
  }

  void addHouses(double side) {
    Random random(seed_, side > 0 ? 31 : 32);
    double s = begin_ + random.uniform(0.0, 10.0);
    while (s < end_) {
      if (random.chance(side > 0 ? 0.12 : 0.35)) {
        s += random.uniform(6.0, 22.0);
        continue;
      }
      const double length = random.uniform(10.0, 24.0), depth = random.uniform(8.0, 11.0);
      double setback = side > 0 ? random.uniform(7.5, 12.0) : random.uniform(12.0, 19.0);
      // In bends the ends of a house would reach the road: move it back until it fits.
      for (int attempt = 0; attempt < 3; ++attempt, setback += 3.5)
        if (addHouse(random, s + 0.5 * length, side, setback, length, depth)) break;
      s += length + random.uniform(0.5, 6.0);
    }
  }

  void addSecondRow(double side) {
    Random random(seed_, side > 0 ? 33 : 34);
    for (double s = begin_; s < end_;) {
      const double length = random.uniform(10.0, 24.0);
      addHouse(random, s + 0.5 * length, side, random.uniform(30.0, 50.0), length, 10.0);
      s += length + random.uniform(2.0, 16.0);
    }
  }

  bool addHouse(Random& random, double s, double side, double setback, double length, double depth) {
    const Axes axes = axesAt(s);
    const Vector3 along = 0.5 * length * axes.ahead, back = 0.5 * depth * side * axes.right;
    const Vector2 centre = road_->beside(s, side * (setback + 0.5 * depth));
    if (!isFree(centre, plan(along), plan(back), 1.8)) return false;
    take(centre, plan(along), plan(back));

    const double height = random.uniform(5.5, 12.5), albedo = random.uniform(0.75, 1.05);
    const int style = random.chance(0.4) ? 3 * random.index(2) : random.index(kFacadeCount);
    const auto material = static_cast<Material>(static_cast<int>(Material::kFacade) + style);
    const double foundation = 1.5;  // walls reach into the ground where it slopes
    const Vector3 base = onGround(centre), down(0.0, height + foundation, 0.0), top = base + height * kUp;
    const double s0 = 3.2 * random.index(4), t0 = -std::fmod(height, 3.2) + 3.2 * random.index(4) + 12.8;
    mesh_.addPanel(top - along - back, 2.0 * along, down, material, albedo, s0, t0);
    mesh_.addPanel(top - along + back, 2.0 * along, down, material, albedo, s0, t0);
    mesh_.addPanel(top - along - back, 2.0 * back, down, material, albedo, s0 + 1.2, t0);
    mesh_.addPanel(top + along - back, 2.0 * back, down, material, albedo, s0 + 1.2, t0);

    // Roof: gable along the street with eaves, or flat with an attic.
    const double overhang = 1.06;
    if (random.chance(0.7)) {
      const Vector3 ridge = random.uniform(2.0, 3.8) * kUp;
      const double tiles = random.uniform(0.25, 0.55);
      for (const double slope : {-1.0, 1.0}) {
        const Vector3 eaves = top + slope * overhang * back - 0.06 * ridge;
        mesh_.addQuad(eaves - overhang * along, eaves + overhang * along, top + overhang * along + ridge,
                      top - overhang * along + ridge, Material::kRoof, tiles);
      }
      for (const double end : {-1.0, 1.0})
        mesh_.addQuad(top + end * along - back, top + end * along + back, top + end * along + ridge,
                      top + end * along + ridge, Material::kConcrete, albedo);
      mesh_.addBox(top + 0.4 * along + ridge, 0.3 * axes.ahead, 0.3 * axes.right, 0.7 * kUp, Material::kBrick, 0.6);
    } else {
      mesh_.addBox(top + 0.1 * kUp, overhang * along, overhang * back, 0.2 * kUp, Material::kConcrete, 0.5);
    }
    // A plinth, balconies or scaffolding give the front relief.
    const Vector3 front = base - back;
    mesh_.addBox(front + 0.1 * kUp, along, 0.04 * axes.right, 0.5 * kUp, Material::kConcrete, 0.45);
    if (random.chance(0.14)) {
      addScaffolding(front - 0.8 * side * axes.right, along, 0.45 * side * axes.right, height);
    } else if (random.chance(0.35)) {
      for (double at = -0.8; at < 0.85; at += 3.2 / length * 2.0)
        for (double level = 2.6; level < height - 2.0; level += 3.2)
          if (random.chance(0.6)) addBalcony(front + at * along + level * kUp, axes, side);
    }
    return true;
  }

  void addBalcony(const Vector3& at, const Axes& axes, double side) {
    const Vector3 out = -0.55 * side * axes.right, along = 1.1 * axes.ahead;
    mesh_.addBox(at + out, along, 0.55 * axes.right, 0.07 * kUp, Material::kConcrete, 0.8);
    for (double x = -1.0; x <= 1.01; x += 0.125)
      mesh_.addTube(at + 2.0 * out + x * along, at + 2.0 * out + x * along + 0.95 * kUp, 0.014, 0.014, 4,
                    Material::kFlat, 0.25);
    mesh_.addBox(at + 2.0 * out + 0.97 * kUp, along, 0.03 * axes.right, 0.03 * kUp, Material::kFlat, 0.3);
  }

  void addScaffolding(const Vector3& front, const Vector3& along, const Vector3& half_width, double height) {
    const int bays = std::max(2, static_cast<int>(along.norm() * 2.0 / 2.4));
    for (const double row : {-1.0, 1.0}) {
      for (int bay = 0; bay <= bays; ++bay) {
        const Vector3 foot = front + row * half_width + (2.0 * bay / bays - 1.0) * along;
        mesh_.addTube(foot - 0.5 * kUp, foot + (height + 0.8) * kUp, 0.03, 0.03, 5, Material::kFlat, 0.5);
        if (row < 0.0 && bay < bays && bay % 2 == 0)
          mesh_.addTube(foot, foot + 2.0 / bays * along + 2.0 * kUp, 0.025, 0.025, 5, Material::kFlat, 0.45);
      }
      for (double level = 2.0; level < height + 0.6; level += 2.0)
        for (const double rail : {0.0, 0.5, 1.0}) {
          const Vector3 at = front + row * half_width + (level + rail) * kUp;
          mesh_.addTube(at - along, at + along, 0.022, 0.022, 4, Material::kFlat, 0.55);
        }
    }
    for (double level = 2.0; level < height + 0.6; level += 2.0)
      mesh_.addBox(front + level * kUp, along, half_width, 0.025 * kUp, Material::kBark, 0.7);
  }

  void addTrees(double side) {
    Random random(seed_, side > 0 ? 35 : 36);
    for (double s = begin_; s < end_; s += random.uniform(5.5, 11.0)) {
      if (random.chance(side > 0 ? 0.45 : 0.15)) continue;
      const double lateral = side > 0 ? random.uniform(5.0, 6.4) : random.uniform(7.2, 9.5);
      addTree(random, road_->beside(s, side * lateral), random.uniform(0.75, 1.25), 520);
    }
    for (double s = begin_; s < end_; s += random.uniform(4.0, 12.0))
      addTree(random, road_->beside(s, side * random.uniform(13.0, 60.0)), random.uniform(1.1, 2.2), 90);
  }

  void addTree(Random& random, const Vector2& p, double size, int leaves) {
    if (!isFree(p, 0.8)) return;
    occupancy_.take(p);
    const Vector3 foot = onGround(p);
    const double trunk = size * random.uniform(2.0, 2.8), crown_radius = size * random.uniform(1.1, 1.8);
    const double crown_height = size * random.uniform(1.7, 2.6);
    const Vector3 lean(0.05 * random.normal(), 0.0, 0.05 * random.normal());
    const Vector3 fork = foot + trunk * (kUp + lean);
    const Vector3 heart = fork + 0.7 * crown_height * kUp;
    mesh_.addTube(foot - 0.4 * kUp, fork, 0.10 * size, 0.07 * size, 8, Material::kBark, 0.55);
    if (size < 1.0 && leaves > 400 && random.chance(0.6))  // young trees are held by stakes
      for (int i = 0; i < 3; ++i) {
        const double angle = 2.1 * i + 0.3;
        const Vector3 out(std::cos(angle), 0.0, std::sin(angle));
        mesh_.addTube(foot + 0.55 * out - 0.4 * kUp, foot + 0.3 * out + 1.9 * kUp, 0.035, 0.035, 6, Material::kBark,
                      0.75);
      }
    // The crown is a heap of tufts: a lumpy core of foliage, with single leaves that stand out from it.
    const int tufts = 13 + random.index(6);
    for (int tuft = 0; tuft < tufts; ++tuft) {
      Vector3 direction(random.normal(), random.normal(), random.normal());
      direction.normalize();
      const double depth = std::cbrt(random.uniform(0.1, 1.0));
      const Vector3 centre = heart + 0.85 * depth *
                                         Vector3(crown_radius * direction.x(), crown_height * 0.75 * direction.y(),
                                                 crown_radius * direction.z());
      if (tuft % 3 == 0)
        mesh_.addTube(fork + random.uniform(0.0, 0.5) * (heart - fork), centre, 0.03 * size, 0.01 * size, 4,
                      Material::kBark, 0.4);
      const double radius = crown_radius * random.uniform(0.24, 0.42);
      addTuft(random, centre, 0.72 * radius);
      for (int leaf = 0; leaf < leaves / tufts; ++leaf) {
        Vector3 out(random.normal(), random.normal(), random.normal());
        out.normalize();
        addLeaf(random, centre + radius * random.uniform(0.7, 1.2) * out, size * random.uniform(0.05, 0.10));
      }
    }
  }

  /// A rough ball of foliage.
  void addTuft(Random& random, const Vector3& centre, double radius) {
    constexpr int kRings = 4, kSides = 6;
    Vector3 points[kRings + 1][kSides];
    for (int ring = 0; ring <= kRings; ++ring)
      for (int side = 0; side < kSides; ++side) {
        const double polar = M_PI * ring / kRings, around = 2.0 * M_PI * (side + 0.5 * (ring % 2)) / kSides;
        const double r = radius * (ring == 0 || ring == kRings ? 0.9 : random.uniform(0.7, 1.1));
        points[ring][side] = centre + r * Vector3(std::sin(polar) * std::cos(around), -std::cos(polar),
                                                  std::sin(polar) * std::sin(around));
      }
    const double albedo = random.uniform(0.7, 1.1), s0 = random.uniform(0.0, 9.0), t0 = random.uniform(0.0, 9.0);
    for (int ring = 0; ring < kRings; ++ring)
      for (int side = 0; side < kSides; ++side)
        mesh_.addQuad(points[ring][side], points[ring][(side + 1) % kSides], points[ring + 1][(side + 1) % kSides],
                      points[ring + 1][side], Material::kFoliage, albedo, s0 + radius * side, t0 + radius * ring);
  }

  void addLeaf(Random& random, const Vector3& at, double half) {
    Vector3 normal(random.normal(), random.normal() - 0.6, random.normal());
    normal.normalize();
    const double turn = random.uniform(0.0, 2.0 * M_PI);
    const Vector3 a0 = normal.unitOrthogonal(), b0 = normal.cross(a0);
    const Vector3 a = half * (std::cos(turn) * a0 + std::sin(turn) * b0);
    const Vector3 b = 0.6 * half * (std::cos(turn) * b0 - std::sin(turn) * a0);
    // A rhombus: leaves have tips.
    mesh_.addQuad(at - a, at - b, at + a, at + b, Material::kLeaf, random.uniform(0.16, 0.4));
  }

  void addGarden(double side) {
    Random random(seed_, side > 0 ? 37 : 38);
    for (double s = begin_; s < end_; s += 1.0) {
      const double stretch = random.uniform(4.0, 14.0);
      const double kind = random.uniform();
      if (kind < 0.35)
        addHedge(random, s, stretch, side * random.uniform(6.6, 9.5));
      else if (kind < 0.6)
        addFence(s, stretch, side * random.uniform(6.0, 8.0));
      else if (kind < 0.7)
        addWall(s, stretch, side * random.uniform(7.0, 9.0));
      s += stretch + random.uniform(0.0, 8.0);
    }
  }

  void addHedge(Random& random, double s, double length, double lateral) {
    const double height = random.uniform(0.6, 1.5);
    for (double at = s; at < s + length; at += 0.5) {
      const Vector2 p = road_->beside(at, lateral);
      if (!isFree(p, 0.9)) continue;
      const Vector3 foot = onGround(p);
      const Axes axes = axesAt(at);
      mesh_.addBox(foot + 0.4 * height * kUp, 0.27 * axes.ahead, 0.25 * axes.right, 0.5 * height * kUp,
                   Material::kFoliage, 0.9);
      for (int leaf = 0; leaf < 36; ++leaf) {
        const Vector3 offset = random.normal() * 0.2 * axes.right + random.uniform(-0.35, 0.35) * axes.ahead +
                               random.uniform(0.0, height) * kUp;
        addLeaf(random, foot + 1.25 * offset, random.uniform(0.04, 0.09));
      }
    }
  }

  void addFence(double s, double length, double lateral) {
    for (double at = s; at < s + length; at += 0.16) {
      const Vector2 p = road_->beside(at, lateral);
      if (!isFree(p, 0.7)) continue;
      const Axes axes = axesAt(at);
      const Vector3 foot = onGround(p);
      mesh_.addBox(foot + 0.5 * kUp, 0.045 * axes.ahead, 0.012 * axes.right, 0.55 * kUp, Material::kBark, 0.85);
    }
    for (double at = s + 0.5; at + 0.5 < s + length; at += 1.0) {
      const Vector2 p = road_->beside(at, lateral);
      const Axes axes = axesAt(at);
      if (!isFree(p, 0.5 * plan(axes.ahead), Vector2::Zero(), 0.7)) continue;
      for (const double rail : {0.3, 0.8})
        mesh_.addBox(onGround(p) + rail * kUp, 0.5 * axes.ahead, 0.02 * axes.right, 0.03 * kUp, Material::kBark, 0.6);
    }
  }

  void addWall(double s, double length, double lateral) {
    for (double at = s; at < s + length; at += 2.0) {
      const Vector2 p = road_->beside(at + 1.0, lateral);
      const Axes axes = axesAt(at + 1.0);
      if (!isFree(p, plan(axes.ahead), Vector2::Zero(), 0.9)) continue;
      mesh_.addBox(onGround(p) + 0.3 * kUp, 1.02 * axes.ahead, 0.12 * axes.right, 0.8 * kUp, Material::kBrick, 0.8);
    }
  }

  void addFurniture(double side) {
    Random random(seed_, side > 0 ? 39 : 40);
    for (double s = begin_; s < end_; s += random.uniform(24.0, 32.0)) addLamp(s, side);
    for (double s = begin_ + 9.0; s < end_; s += random.uniform(15.0, 45.0)) {
      const double lateral = side * (side > 0 ? 4.4 : 6.4);
      const Vector2 p = road_->beside(s, lateral);
      if (!isFree(p, 0.45)) continue;
      const Vector3 foot = onGround(p);
      const Axes axes = axesAt(s);
      const double height = random.uniform(2.2, 2.9);
      mesh_.addTube(foot - 0.4 * kUp, foot + height * kUp, 0.035, 0.035, 7, Material::kFlat, 0.5);
      const double half = random.uniform(0.25, 0.4);
      mesh_.addPanel(foot + height * kUp - half * axes.right - 0.05 * axes.ahead, 2.0 * half * axes.right,
                     -2.0 * half * kUp, Material::kPoster, 0.95, random.uniform(0.0, 4.0), random.uniform(0.0, 4.0));
    }
    for (double s = begin_ + 30.0; s < end_; s += random.uniform(50.0, 110.0)) addBillboard(random, s, side);
  }

  void addLamp(double s, double side) {
    const Vector2 p = road_->beside(s, side > 0 ? 4.9 : -6.2);
    if (!isFree(p, 0.5)) return;
    const Vector3 foot = onGround(p), top = foot + 5.5 * kUp;
    const Axes axes = axesAt(s);
    mesh_.addTube(foot - 0.4 * kUp, foot + 1.2 * kUp, 0.08, 0.08, 9, Material::kConcrete, 0.35);
    mesh_.addTube(foot + 1.2 * kUp, top, 0.055, 0.04, 9, Material::kFlat, 0.22);
    mesh_.addTube(top, top - side * 1.0 * axes.right + 0.25 * kUp, 0.035, 0.03, 7, Material::kFlat, 0.22);
    mesh_.addBox(top - side * 1.1 * axes.right + 0.27 * kUp, 0.12 * axes.ahead, 0.35 * axes.right, 0.06 * kUp,
                 Material::kFlat, 0.3);
  }

  void addBillboard(Random& random, double s, double side) {
    const Vector2 p = road_->beside(s, side * (side > 0 ? 6.2 : 9.5));
    const Axes axes = axesAt(s);
    const Vector3 across = (axes.right + side * 0.25 * axes.ahead).normalized();
    if (!isFree(p, 1.3 * plan(across), Vector2::Zero(), 0.5)) return;
    take(p, 1.3 * plan(across), Vector2::Zero());
    const Vector3 foot = onGround(p);
    for (const double leg : {-0.8, 0.8})
      mesh_.addBox(foot + leg * across + 0.6 * kUp, 0.06 * axes.ahead, 0.06 * axes.right, 1.2 * kUp,
                   Material::kConcrete, 0.5);
    mesh_.addPanel(foot + 3.4 * kUp - 1.2 * across - 0.08 * axes.ahead, 2.4 * across, -2.2 * kUp, Material::kPoster,
                   1.0, 4.0 * random.uniform(), 4.0 * random.uniform());
  }

  void addParkedCars(double side) {
    Random random(seed_, side > 0 ? 41 : 42);
    // Right: a bay at the edge of the road, left: beyond the oncoming lane. Both keep clear of either lane anywhere.
    const double lateral = side > 0 ? 4.75 : -7.6;
    for (double s = begin_; s < end_; s += 6.2) {
      if (!random.chance(side > 0 ? 0.34 : 0.22)) continue;
      const Vector2 p = road_->beside(s, lateral);
      const Axes axes = axesAt(s);
      if (!isFree(p, 2.2 * plan(axes.ahead), 0.8 * plan(axes.right), 0.15)) continue;
      take(p, 2.2 * plan(axes.ahead), 0.8 * plan(axes.right));
      const Vector3 ahead = random.chance(side > 0 ? 0.8 : 0.3) ? axes.ahead : Vector3(-axes.ahead);
      mesh_.append(makeCar(random.index(kCarModels), random.uniform(), random.bits()),
                   placeCar(onGround(p), ahead, (onGround(p + plan(ahead)) - onGround(p - plan(ahead)))));
    }
  }

  /// A closed curtain of trees where the ground ends: the horizon of a street is never bare.
  void addWood() {
    Random random(seed_, 43);
    const float level = static_cast<float>(GroundMap::kReach - 6.0);
    constexpr int kStride = 4;
    for (int row = 0; row + kStride < ground_->rows(); row += kStride)
      for (int column = 0; column + kStride < ground_->columns(); column += kStride) {
        std::vector<Vector2> crossings;
        const int corners[5][2] = {{0, 0}, {0, kStride}, {kStride, kStride}, {kStride, 0}, {0, 0}};
        for (int edge = 0; edge < 4; ++edge) {
          const int r0 = row + corners[edge][0], c0 = column + corners[edge][1];
          const int r1 = row + corners[edge + 1][0], c1 = column + corners[edge + 1][1];
          const float d0 = std::min(ground_->node(r0, c0).path, 99.0f) - level;
          const float d1 = std::min(ground_->node(r1, c1).path, 99.0f) - level;
          if ((d0 < 0.0f) == (d1 < 0.0f)) continue;
          const double share = d0 / (d0 - d1);
          crossings.push_back((1.0 - share) * ground_->position(r0, c0) + share * ground_->position(r1, c1));
        }
        if (crossings.size() < 2) continue;
        const Vector3 a = onGround(crossings[0]) - 4.0 * kUp, b = onGround(crossings[1]) - 4.0 * kUp;
        const double height = random.uniform(12.0, 17.0);
        mesh_.addQuad(a + height * kUp, b + (height + random.uniform(-1.5, 1.5)) * kUp, b, a, Material::kFoliage, 0.5,
                      a.x() + a.z());
        for (int leaf = 0; leaf < 60; ++leaf)
          addLeaf(random, a + random.uniform() * (b - a) + (height + random.normal() * 0.9) * kUp,
                  random.uniform(0.2, 0.6));
      }
  }

  std::uint64_t seed_;
  std::shared_ptr<const RoadLine> road_;
  std::shared_ptr<const GroundMap> ground_;
  double begin_, end_;
  Mesh mesh_;
  Occupancy occupancy_;
};

}  // namespace

World makeStreetWorld(const DrivePath& path, std::uint64_t seed) {
  return Street(path, seed).build();
}

}  // namespace sdvo::render
