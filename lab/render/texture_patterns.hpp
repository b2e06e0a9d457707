#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "texture.hpp"

namespace sdvo::render {

/// What a surface is made of; each has its texture in a TextureSet.
enum class Material : std::uint8_t {
  kFlat,
  kGround,  ///< asphalt, kerb, paving and grass by the distance to the road
  kLeaf,
  kAsphalt,
  kGrass,
  kPaving,
  kBrick,
  kBark,
  kRoof,
  kFoliage,
  kConcrete,
  kPoster,
  kCarSide,
  kPlaster,
  kFacade,  ///< the first of kFacadeCount
};
constexpr int kFacadeCount = 6;

/// The procedural textures of a world, all derived from the seed. Every one has a 1/f part, as photographs have.
class TextureSet {
 public:
  /// `scale` shrinks or stretches all of them; at 1 a brick is 25 cm long.
  explicit TextureSet(std::uint64_t seed, double scale = 1.0);
  /// A set with the one texture given in every place, for tests.
  explicit TextureSet(const Texture& only);

  /// Null for materials without texture.
  const Texture* of(Material material) const { return textures_[static_cast<std::size_t>(material)].get(); }
  /// Fine 1/f detail that is laid over every texture.
  const Texture& detail() const { return *detail_; }

 private:
  std::vector<std::shared_ptr<const Texture>> textures_;
  std::shared_ptr<const Texture> detail_;
};

/// Tileable noise with amplitude proportional to 1/f^exponent, mean 0 and standard deviation 1.
cv::Mat1f makeNoise(int side, double exponent, std::uint64_t seed);

}  // namespace sdvo::render
