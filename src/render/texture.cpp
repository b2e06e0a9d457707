#include "texture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace sdvo::render {

namespace {

constexpr float kMaxProbes = 3.0f;
// The bilinear kernel blurs by itself; this much of a level sharper keeps the sum of both close to one pixel.
constexpr float kLodBias = -0.5f;

/// std::floor is a function call on processors without SSE 4.1, for which packages are built.
int quickFloor(float x) {
  const int truncated = static_cast<int>(x);
  return truncated - (x < static_cast<float>(truncated) ? 1 : 0);
}

/// log2 with the mantissa taken linearly (at most 0.09 too low): continuous, which is all a level needs.
float quickLog2(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return static_cast<float>(bits) * (1.0f / 8388608.0f) - 127.0f;
}

}  // namespace

Texture::Texture(const cv::Mat1f& image, double size)
    : size_(size), side_(image.rows), texels_per_metre_(static_cast<float>(image.rows / size)) {
  if (image.rows != image.cols || side_ < 1 || (side_ & (side_ - 1)) != 0)
    throw std::invalid_argument("a texture must be square with a power of two as side");
  cv::Mat1f level = image.clone();
  while (true) {
    std::vector<std::uint16_t> texels(static_cast<std::size_t>(level.rows) * level.cols);
    for (int row = 0; row < level.rows; ++row)
      for (int col = 0; col < level.cols; ++col)
        texels[static_cast<std::size_t>(row) * level.cols + col] =
            static_cast<std::uint16_t>(std::lround(std::clamp(level(row, col), 0.0f, 1.0f) * 65535.0f));
    levels_.push_back(std::move(texels));
    if (level.rows == 1) break;
    cv::Mat1f half(level.rows / 2, level.cols / 2);
    for (int row = 0; row < half.rows; ++row)
      for (int col = 0; col < half.cols; ++col)
        half(row, col) = 0.25f * (level(2 * row, 2 * col) + level(2 * row, 2 * col + 1) + level(2 * row + 1, 2 * col) +
                                  level(2 * row + 1, 2 * col + 1));
    level = half;
  }
}

float Texture::bilinear(int level, float s, float t) const {
  const int side = side_ >> level;
  const int mask = side - 1;
  const float scale = 1.0f / static_cast<float>(1 << level);
  const float x = s * scale - 0.5f, y = t * scale - 0.5f;
  const int floor_x = quickFloor(x), floor_y = quickFloor(y);
  const float wx = x - static_cast<float>(floor_x), wy = y - static_cast<float>(floor_y);
  const int x0 = floor_x & mask, y0 = floor_y & mask;
  const int x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  const std::uint16_t* top = &levels_[level][static_cast<std::size_t>(y0) * side];
  const std::uint16_t* bottom = &levels_[level][static_cast<std::size_t>(y1) * side];
  const float upper = top[x0] + wx * (static_cast<float>(top[x1]) - top[x0]);
  const float lower = bottom[x0] + wx * (static_cast<float>(bottom[x1]) - bottom[x0]);
  return (upper + wy * (lower - upper)) * (1.0f / 65535.0f);
}

float Texture::trilinear(float lod, float s, float t) const {
  const int last = static_cast<int>(levels_.size()) - 1;
  if (lod <= 0.0f) return bilinear(0, s, t);
  if (lod >= static_cast<float>(last)) return bilinear(last, s, t);
  const int level = static_cast<int>(lod);
  // Levels change over within the middle of the interval only: most lookups need just one.
  const float weight = (lod - static_cast<float>(level) - 0.25f) * 2.0f;
  if (weight <= 0.0f) return bilinear(level, s, t);
  if (weight >= 1.0f) return bilinear(level + 1, s, t);
  const float fine = bilinear(level, s, t);
  return fine + weight * (bilinear(level + 1, s, t) - fine);
}

float Texture::sample(float s, float t, const Footprint& footprint) const {
  const float squared_x = footprint.s_x * footprint.s_x + footprint.t_x * footprint.t_x;
  const float squared_y = footprint.s_y * footprint.s_y + footprint.t_y * footprint.t_y;
  const bool along_x = squared_x > squared_y;
  const float axis_s = (along_x ? footprint.s_x : footprint.s_y) * texels_per_metre_;
  const float axis_t = (along_x ? footprint.t_x : footprint.t_y) * texels_per_metre_;
  const float major = std::sqrt(std::max(squared_x, squared_y)) * texels_per_metre_;
  const float area =
      std::abs(footprint.s_x * footprint.t_y - footprint.t_x * footprint.s_y) * texels_per_metre_ * texels_per_metre_;
  const float minor = std::max(area / std::max(major, 1e-6f), 1e-6f);
  const int probes = static_cast<int>(std::clamp(major / std::max(minor, 1.0f) + 0.5f, 1.0f, kMaxProbes));
  const float lod = quickLog2(std::max(minor, major / static_cast<float>(probes))) + kLodBias;
  s *= texels_per_metre_;
  t *= texels_per_metre_;
  if (probes == 1) return trilinear(lod, s, t);
  float sum = 0.0f;
  for (int probe = 0; probe < probes; ++probe) {
    const float offset = (static_cast<float>(probe) + 0.5f) / static_cast<float>(probes) - 0.5f;
    sum += trilinear(lod, s + offset * axis_s, t + offset * axis_t);
  }
  return sum / static_cast<float>(probes);
}

float Texture::sample(float s, float t, float width) const {
  const float lod = quickLog2(std::max(width * texels_per_metre_, 1e-6f)) + kLodBias;
  return trilinear(lod, s * texels_per_metre_, t * texels_per_metre_);
}

}  // namespace sdvo::render
