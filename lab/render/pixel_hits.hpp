#pragma once

#include <array>
#include <cstdint>

#include "sample_pattern.hpp"

namespace sdvo::render {

/// What a ray meets first.
struct Hit {
  static constexpr int kSky = -2, kStatic = -1;
  static constexpr std::uint32_t kSkyKey = 0xffffffffu, kGroundKey = 0xfffffffeu;

  std::uint32_t key = kSkyKey;  ///< equal for hits on one surface: a quadrilateral, all of the ground, or the sky
  int car = kSky;               ///< index into the moving scene's cars, or kSky, kStatic
  std::uint32_t quad = 0;
  float depth = 0.0f, u = 0.0f, v = 0.0f;

  bool isSame(const Hit& other) const { return key == other.key; }
};

/// Samples of one pixel that met the same surface.
struct HitGroup {
  Hit first;
  int count;
  float depth, u, v, x, y;  ///< sums; x, y: place within the pixel

  SampleOffset meanOffset() const {
    const float mean = 1.0f / static_cast<float>(count);
    return {x * mean, y * mean};
  }
};

/// What the samples of a pixel have met so far.
class PixelHits {
 public:
  void clear() { count_ = 0; }
  void add(const Hit& hit, const SampleOffset& offset) {
    int i = 0;
    while (i < count_ && !groups_[i].first.isSame(hit)) ++i;
    if (i == count_) {
      groups_[count_++] = {hit, 1, hit.depth, hit.u, hit.v, offset.x, offset.y};
      return;
    }
    HitGroup& group = groups_[i];
    ++group.count;
    group.depth += hit.depth;
    group.u += hit.u;
    group.v += hit.v;
    group.x += offset.x;
    group.y += offset.y;
  }
  bool isOne() const { return count_ == 1; }
  const HitGroup* begin() const { return groups_.data(); }
  const HitGroup* end() const { return groups_.data() + count_; }

 private:
  std::array<HitGroup, kFineSamples> groups_;
  int count_ = 0;
};

}  // namespace sdvo::render
