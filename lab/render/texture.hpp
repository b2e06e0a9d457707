#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace sdvo::render {

/// What one pixel covers on a textured surface: the two edges of its image there, as (s, t) vectors in metres.
struct Footprint {
  float s_x = 0.0f, t_x = 0.0f;  ///< per pixel to the right
  float s_y = 0.0f, t_y = 0.0f;  ///< per pixel down
};

/// A tileable grey texture with a box-filtered pyramid. It is looked up with the pixel's footprint (trilinear, with
/// several probes along the longer axis where the surface is seen at a grazing angle), so that positions are right to
/// a small fraction of a pixel at any distance.
class Texture {
 public:
  /// `image` holds reflectances in 0 … 1, is square with a power of two as side (else std::invalid_argument) and is
  /// repeated every `size` metres.
  Texture(const cv::Mat1f& image, double size);

  /// Mean reflectance over the footprint around (s, t) in metres; s runs along columns, t along rows, the origin is the
  /// outer corner of the first texel.
  float sample(float s, float t, const Footprint& footprint) const;

  /// The same for a square footprint of `width` metres: cheaper, and blurs where the surface is seen at an angle.
  float sample(float s, float t, float width) const;

  double size() const { return size_; }

 private:
  /// Places are in 1/256 of the finest level's texels.
  float bilinear(int level, std::int32_t s, std::int32_t t) const;
  float trilinear(float lod, float s, float t) const;

  double size_;
  int side_;
  float steps_per_metre_;  ///< 1/256 of a texel each
  int last_level_ = 0;
  std::vector<std::size_t> level_begin_;
  std::vector<std::uint16_t> texels_;  ///< of all levels, the finest first
};

}  // namespace sdvo::render
