#include <algorithm>
#include <cmath>
#include <thread>

#include "ray_caster.hpp"
#include "world.hpp"

namespace sdvo::render {

namespace {

/// Calls work(i) for i in 0 … count - 1 from several threads, each taking every n-th.
template <class Work>
void parallelFor(int count, int threads, const Work& work) {
  std::vector<std::thread> pool;
  for (int thread = 0; thread < threads; ++thread)
    pool.emplace_back([&, thread] {
      for (int i = thread; i < count; i += threads) work(i);
    });
  for (std::thread& thread : pool) thread.join();
}

}  // namespace

SunlightMap::SunlightMap(const GroundMap& ground, const RayCaster& caster, const Eigen::Vector3d& to_sun, int threads)
    : origin_(ground.position(0, 0)) {
  constexpr double kBaked = 20.0;  // from the way, m; beyond, shadows are too flat to see
  columns_ = static_cast<int>(ground.columns() * ground.cell() / kTileSize) + 1;
  rows_ = static_cast<int>(ground.rows() * ground.cell() / kTileSize) + 1;
  tile_index_.assign(static_cast<std::size_t>(columns_) * rows_, -1);
  std::vector<int> tiles;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) {
      const Eigen::Vector2d middle = origin_ + kTileSize * Eigen::Vector2d(column + 0.5, row + 0.5);
      if (ground.at(middle.x(), middle.y()).path > kBaked) continue;
      tile_index_[static_cast<std::size_t>(row) * columns_ + column] = static_cast<int>(tiles.size());
      tiles.push_back(row * columns_ + column);
    }
  for (int level = 0; level < kLevels; ++level) {
    const int side = kTileSide >> level;
    texels_[level].resize(tiles.size() * side * side);
  }
  const Eigen::Vector3f direction = to_sun.cast<float>();
  parallelFor(static_cast<int>(tiles.size()), threads, [&](int tile) {
    const int row = tiles[static_cast<std::size_t>(tile)] / columns_,
              column = tiles[static_cast<std::size_t>(tile)] % columns_;
    std::uint8_t* fine = &texels_[0][static_cast<std::size_t>(tile) * kTileSide * kTileSide];
    for (int y = 0; y < kTileSide; ++y)
      for (int x = 0; x < kTileSide; ++x) {
        const Eigen::Vector2d p =
            origin_ + kTexel * Eigen::Vector2d(column * kTileSide + x + 0.5, row * kTileSide + y + 0.5);
        const Eigen::Vector3f origin(static_cast<float>(p.x()), static_cast<float>(ground.height(p.x(), p.y())) - 0.03f,
                                     static_cast<float>(p.y()));
        fine[y * kTileSide + x] = caster.occluded(origin, direction) ? 0 : 255;
      }
    for (int level = 1; level < kLevels; ++level) {
      const int side = kTileSide >> level;
      const std::uint8_t* from = &texels_[level - 1][static_cast<std::size_t>(tile) * 4 * side * side];
      std::uint8_t* to = &texels_[level][static_cast<std::size_t>(tile) * side * side];
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          const std::uint8_t* block = from + 4 * y * side + 2 * x;
          to[y * side + x] =
              static_cast<std::uint8_t>((block[0] + block[1] + block[2 * side] + block[2 * side + 1] + 2) / 4);
        }
    }
  });
}

float SunlightMap::texel(int level, int column, int row) const {
  const int shift = 6 - level;  // log2 of the tile's side
  const int tile_column = column >> shift, tile_row = row >> shift;
  if (tile_column < 0 || tile_row < 0 || tile_column >= columns_ || tile_row >= rows_) return 1.0f;
  const int tile = tile_index_[static_cast<std::size_t>(tile_row) * columns_ + tile_column];
  if (tile < 0) return 1.0f;
  const int side = 1 << shift;
  const std::size_t offset = (static_cast<std::size_t>(tile) << (2 * shift)) +
                             static_cast<std::size_t>((row & (side - 1)) * side + (column & (side - 1)));
  return static_cast<float>(texels_[level][offset]) * (1.0f / 255.0f);
}

float SunlightMap::bilinear(int level, double x, double z) const {
  const double scale = 1.0 / (kTexel * (1 << level));
  const double column = (x - origin_.x()) * scale - 0.5, row = (z - origin_.y()) * scale - 0.5;
  const int c = static_cast<int>(std::floor(column)), r = static_cast<int>(std::floor(row));
  const auto wc = static_cast<float>(column - c), wr = static_cast<float>(row - r);
  const float upper = texel(level, c, r) * (1.0f - wc) + texel(level, c + 1, r) * wc;
  const float lower = texel(level, c, r + 1) * (1.0f - wc) + texel(level, c + 1, r + 1) * wc;
  return upper * (1.0f - wr) + lower * wr;
}

float SunlightMap::sample(double x, double z, double width) const {
  const float lod = std::clamp(std::log2(static_cast<float>(width / kTexel)), 0.0f, kLevels - 1.0f);
  const int level = std::min(static_cast<int>(lod), kLevels - 2);
  const float weight = std::clamp((lod - static_cast<float>(level) - 0.25f) * 2.0f, 0.0f, 1.0f);
  if (weight == 0.0f) return bilinear(level, x, z);
  if (weight == 1.0f) return bilinear(level + 1, x, z);
  const float fine = bilinear(level, x, z);
  return fine + weight * (bilinear(level + 1, x, z) - fine);
}

float World::irradiance(const Eigen::Vector3f& normal, float sun_share) const {
  const float sky_share = 0.75f + 0.5f * std::max(0.0f, -normal.y());  // what lies flat sees more of the sky
  const float facing = std::max(0.0f, normal.dot(to_sun.cast<float>()));
  return static_cast<float>(ambient) * sky_share + static_cast<float>(sun) * sun_share * facing;
}

void lightWorld(World& world, const RayCaster& caster, int threads) {
  const Eigen::Vector3f direction = world.to_sun.cast<float>();
  if (!world.ground) return;
  constexpr int kBlock = 4096;
  const int count = static_cast<int>(world.mesh.surfaces.size());
  parallelFor((count + kBlock - 1) / kBlock, threads, [&](int block) {
    for (int i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) {
      Surface& surface = world.mesh.surfaces[static_cast<std::size_t>(i)];
      // Large surfaces would turn dark or bright as a whole: they are lit without cast shadows.
      if (surface.material == Material::kGround || surface.length_s * surface.length_t > 1.5f) continue;
      const Eigen::Vector3f normal = world.mesh.normal(static_cast<std::size_t>(i));
      if (!normal.allFinite()) continue;
      const Eigen::Vector3f centre = world.mesh.centre(static_cast<std::size_t>(i));
      const bool front_faces = normal.dot(direction) > 0.0f;
      const Eigen::Vector3f outside = front_faces ? normal : Eigen::Vector3f(-normal);
      const float share = caster.occluded(centre + 0.01f * outside, direction) ? 0.0f : 1.0f;
      if (surface.material == Material::kLeaf) surface.sun_front = surface.sun_back = world.irradiance(outside, share);
      // Of anything else the far side is dark by its normal alone.
      else if (front_faces)
        surface.sun_front = share;
      else
        surface.sun_back = share;
    }
  });
  world.sunlight = std::make_shared<SunlightMap>(*world.ground, caster, world.to_sun, threads);
}

}  // namespace sdvo::render
