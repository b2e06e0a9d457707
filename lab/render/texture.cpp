#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace sdvo::render {

namespace {

constexpr int kMaxProbes = 3;
// The bilinear kernel blurs by itself; this much of a level sharper keeps the sum of both close to one pixel.
constexpr float kLodBias = -0.5f;

constexpr float kSteps = 256.0f;  // of a texel

/// log2 with the mantissa taken linearly (at most 0.09 too low): continuous, which is all a level needs.
float quickLog2(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return static_cast<float>(bits) * (1.0f / 8388608.0f) - 127.0f;
}

}  // namespace

Texture::Texture(const cv::Mat1f& image, double size)
    : size_(size), side_(image.rows), steps_per_metre_(static_cast<float>(image.rows / size) * kSteps) {
  if (image.rows != image.cols || side_ < 1 || (side_ & (side_ - 1)) != 0)
    throw std::invalid_argument("a texture must be square with a power of two as side");
  cv::Mat1f level = image.clone();
  while (true) {
    level_begin_.push_back(texels_.size());
    for (const float value : level)
      texels_.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 65535.0f)));
    if (level.rows == 1) break;
    cv::Mat1f half(level.rows / 2, level.cols / 2);
    for (int row = 0; row < half.rows; ++row)
      for (int col = 0; col < half.cols; ++col)
        half(row, col) = 0.25f * (level(2 * row, 2 * col) + level(2 * row, 2 * col + 1) + level(2 * row + 1, 2 * col) +
                                  level(2 * row + 1, 2 * col + 1));
    level = half;
  }
  last_level_ = static_cast<int>(level_begin_.size()) - 1;
}

float Texture::bilinear(int level, std::int32_t s, std::int32_t t) const {
  // Integers throughout: shifts round down on either side of zero, and packages are built for processors whose
  // std::floor is a function call.
  const int side = side_ >> level, mask = side - 1;
  const std::int32_t x = (s >> level) - 128, y = (t >> level) - 128;
  const auto wx = static_cast<std::uint32_t>(x & 255), wy = static_cast<std::uint32_t>(y & 255);
  const int x0 = (x >> 8) & mask, y0 = (y >> 8) & mask;
  const int x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  const std::uint16_t* texels = texels_.data() + level_begin_[static_cast<std::size_t>(level)];
  const std::uint16_t *top = texels + y0 * side, *bottom = texels + y1 * side;
  const std::uint32_t upper = top[x0] * (256u - wx) + top[x1] * wx;
  const std::uint32_t lower = bottom[x0] * (256u - wx) + bottom[x1] * wx;
  // Half a step less than 32 bits can hold.
  const std::uint32_t sum = (upper >> 1) * (256u - wy) + (lower >> 1) * wy;
  return static_cast<float>(static_cast<std::int32_t>(sum)) * (1.0f / (65535.0f * 128.0f * 256.0f));
}

float Texture::trilinear(float lod, float s, float t) const {
  const auto x = static_cast<std::int32_t>(s), y = static_cast<std::int32_t>(t);
  if (lod <= 0.0f) return bilinear(0, x, y);
  if (lod >= static_cast<float>(last_level_)) return bilinear(last_level_, x, y);
  const int level = static_cast<int>(lod);
  // Levels change over within the middle of the interval only: most lookups need just one.
  const float weight = (lod - static_cast<float>(level) - 0.3f) * 2.5f;
  if (weight <= 0.0f) return bilinear(level, x, y);
  if (weight >= 1.0f) return bilinear(level + 1, x, y);
  const float fine = bilinear(level, x, y);
  return fine + weight * (bilinear(level + 1, x, y) - fine);
}

float Texture::sample(float s, float t, const Footprint& footprint) const {
  const float squared_x = footprint.s_x * footprint.s_x + footprint.t_x * footprint.t_x;
  const float squared_y = footprint.s_y * footprint.s_y + footprint.t_y * footprint.t_y;
  const bool along_x = squared_x > squared_y;
  const float axis_s = (along_x ? footprint.s_x : footprint.s_y) * steps_per_metre_;
  const float axis_t = (along_x ? footprint.t_x : footprint.t_y) * steps_per_metre_;
  const float texels_per_metre = steps_per_metre_ / kSteps;
  const float major = std::sqrt(std::max(squared_x, squared_y)) * texels_per_metre;
  const float area =
      std::abs(footprint.s_x * footprint.t_y - footprint.t_x * footprint.s_y) * texels_per_metre * texels_per_metre;
  const float minor = std::max(area / std::max(major, 1e-6f), 1e-6f);
  const float width = std::max(minor, 1.0f);
  const int probes = major < 1.5f * width ? 1 : major < 2.5f * width ? 2 : kMaxProbes;
  const float share = 1.0f / static_cast<float>(probes);
  const float lod = quickLog2(std::max(minor, major * share)) + kLodBias;
  s *= steps_per_metre_;
  t *= steps_per_metre_;
  if (probes == 1) return trilinear(lod, s, t);
  float sum = 0.0f;
  for (int probe = 0; probe < probes; ++probe) {
    const float offset = (static_cast<float>(probe) + 0.5f) * share - 0.5f;
    sum += trilinear(lod, s + offset * axis_s, t + offset * axis_t);
  }
  return sum * share;
}

float Texture::sample(float s, float t, float width) const {
  const float lod = quickLog2(std::max(width * (steps_per_metre_ / kSteps), 1e-6f)) + kLodBias;
  return trilinear(lod, s * steps_per_metre_, t * steps_per_metre_);
}

}  // namespace sdvo::render
