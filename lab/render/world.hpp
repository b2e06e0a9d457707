#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "drive_path.hpp"
#include "ground_map.hpp"
#include "mesh.hpp"
#include "texture_patterns.hpp"

namespace sdvo::render {

class RayCaster;

/// Sunlight on the ground around the road, baked once: the cast shadows of trees and houses, which are much of what a
/// corner detector finds on asphalt. Values are the visible share of the sun.
class SunlightMap {
 public:
  /// Casts one ray to the sun per texel within reach of the road, on `threads` threads.
  SunlightMap(const GroundMap& ground, const RayCaster& caster, const Eigen::Vector3d& to_sun, int threads);

  /// Mean over a footprint of about `width` metres; 1 where nothing was baked.
  float sample(double x, double z, double width) const;

 private:
  static constexpr int kTileSide = 64;     ///< texels
  static constexpr double kTexel = 0.125;  ///< m
  static constexpr int kLevels = 4;
  static constexpr double kTileSize = kTileSide * kTexel;

  float texel(int level, int column, int row) const;
  float bilinear(int level, double x, double z) const;

  Eigen::Vector2d origin_;
  int columns_ = 0, rows_ = 0;   ///< of tiles
  std::vector<int> tile_index_;  ///< −1: not baked
  std::vector<std::uint8_t> texels_[kLevels];
};

/// Everything that stands still, and the light on it.
struct World {
  Mesh mesh;
  std::shared_ptr<const TextureSet> textures;
  std::shared_ptr<const RoadLine> road;         ///< null indoors
  std::shared_ptr<const GroundMap> ground;      ///< null indoors
  std::shared_ptr<const SunlightMap> sunlight;  ///< null until lit, and indoors
  Eigen::Vector3d to_sun = Eigen::Vector3d(-0.50, -0.62, -0.60);
  double ambient = 0.30;       ///< irradiance without the sun
  double sun = 1.50;           ///< irradiance of a surface that faces the sun
  double haze_distance = 700;  ///< m after which 1 - 1/e of the light is the air's; 0: none
  float sky = 0.50f;           ///< brightness at the horizon, 1 = white

  /// Irradiance of a surface seen from the side this unit normal points to.
  float irradiance(const Eigen::Vector3f& normal, float sun_share) const;
};

enum class Scenery { kStreet, kRoom, kCorridor, kDesk };

/// A world around `path`; throws std::invalid_argument when the path does not suit it.
/// - street: houses, trees, poles and parked cars along the whole of the path. Nothing stands on any part of it, so
/// that
///   ways that cross or repeat themselves stay drivable.
/// - room: a machine hall with pipes, crates and shelves that keep clear of the path, which must fit into 60 m.
/// - corridor: plain walls with doors along the CorridorPlan of this seed, between whose walls the path must stay.
/// - desk: things on a desk 0.3 to 1 m ahead of the path, which must fit into 1 m.
World makeWorld(Scenery scenery, const DrivePath& path, std::uint64_t seed);

World makeStreetWorld(const DrivePath& path, std::uint64_t seed);
World makeRoomWorld(const DrivePath& path, std::uint64_t seed);
World makeCorridorWorld(const DrivePath& path, std::uint64_t seed);
World makeDeskWorld(const DrivePath& path, std::uint64_t seed);

/// Finds which small surfaces lie in the shadow and bakes the sunlight on the ground.
void lightWorld(World& world, const RayCaster& caster, int threads);

}  // namespace sdvo::render
