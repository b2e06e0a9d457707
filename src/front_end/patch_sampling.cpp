#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <array>
#include <cstring>

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

/// Where a row of the patch lies in the image. The four pixels around a position weigh the same all along a row.
struct SampledRow {
  const std::uint8_t *upper, *lower;
  float w00, w01, w10, w11;
};

void sampleFrom(int i, const SampledRow& row, int columns, float* values) {
  const auto& [upper, lower, w00, w01, w10, w11] = row;
  for (; i < columns; ++i) values[i] = w00 * upper[i] + w01 * upper[i + 1] + w10 * lower[i] + w11 * lower[i + 1];
}

void samplePlain(const SampledRow* rows, int count, int columns, float* patch) {
  for (int j = 0; j < count; ++j) sampleFrom(0, rows[j], columns, patch + j * columns);
}

#ifdef SDVO_HAVE_AVX2
SDVO_AVX2 inline __m256 eightPixels(const std::uint8_t* pixels) {
  return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(pixels))));
}

SDVO_AVX2 inline __m128 fourPixels(const std::uint8_t* pixels) {
  int four;
  std::memcpy(&four, pixels, sizeof four);
  return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(four)));
}

/// The same operations in the same order, eight columns at once, and four of the rest.
SDVO_AVX2 void sampleAvx2(const SampledRow* rows, int count, int columns, float* patch) {
  for (int j = 0; j < count; ++j, patch += columns) {
    const auto& [upper, lower, w00, w01, w10, w11] = rows[j];
    int i = 0;
    for (; i + 8 <= columns; i += 8) {
      __m256 sum = _mm256_mul_ps(_mm256_set1_ps(w00), eightPixels(upper + i));
      sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(w01), eightPixels(upper + i + 1)));
      sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(w10), eightPixels(lower + i)));
      sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(w11), eightPixels(lower + i + 1)));
      _mm256_storeu_ps(patch + i, sum);
    }
    if (i + 4 <= columns) {
      __m128 sum = _mm_mul_ps(_mm_set1_ps(w00), fourPixels(upper + i));
      sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(w01), fourPixels(upper + i + 1)));
      sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(w10), fourPixels(lower + i)));
      sum = _mm_add_ps(sum, _mm_mul_ps(_mm_set1_ps(w11), fourPixels(lower + i + 1)));
      _mm_storeu_ps(patch + i, sum);
      i += 4;
    }
    sampleFrom(i, rows[j], columns, patch);
  }
}
#endif

/// std::floor of what an int can hold.
int floorOf(float value) {
  const int truncated = static_cast<int>(value);
  return truncated - static_cast<int>(static_cast<float>(truncated) > value);
}

}  // namespace

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch) {
  std::array<SampledRow, 2 * kLargestPatchRadius + 1> rows;
  const int row = floorOf(y);
  const float b = y - static_cast<float>(row);
  const std::size_t step = image.step[0];
  const std::uint8_t* first = image.ptr(row - radius + margin);
  for (int j = -radius; j <= radius; ++j, first += step) {
    const float start = x - slant * static_cast<float>(j);
    const int column = floorOf(start);
    const float a = start - static_cast<float>(column);
    const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
    const std::uint8_t* upper = first + column - radius + margin;
    rows[static_cast<std::size_t>(j + radius)] = {upper, upper + step, w00, w01, w10, w11};
  }
#ifdef SDVO_HAVE_AVX2
  if (usesAvx2()) return sampleAvx2(rows.data(), 2 * radius + 1, columns, patch);
#endif
  samplePlain(rows.data(), 2 * radius + 1, columns, patch);
}

}  // namespace sdvo
