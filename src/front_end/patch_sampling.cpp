#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <array>
#include <cstddef>
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

/// Eight or four columns of rows that lie right below each other: what is the lower row of one is the upper one of the
/// next.
template <class Vector, Vector (*kPixels)(const std::uint8_t*)>
SDVO_AVX2 inline void sampleColumnsAvx2(const SampledRow& row, std::ptrdiff_t step, int count, int columns,
                                        float* patch) {
  Vector a = kPixels(row.upper), b = kPixels(row.upper + 1);
  const std::uint8_t* lower = row.lower;
  for (int j = 0; j < count; ++j, lower += step, patch += columns) {
    const Vector c = kPixels(lower), d = kPixels(lower + 1);
    const Vector sum = row.w00 * a + row.w01 * b + row.w10 * c + row.w11 * d;
    std::memcpy(patch, &sum, sizeof sum);
    a = c, b = d;
  }
}

SDVO_AVX2 void sampleUprightAvx2(SampledRow row, std::ptrdiff_t step, int count, int columns, float* patch) {
  for (int i = 0; i < columns;) {
    const bool eight = i + 8 <= columns;
    if (eight)
      sampleColumnsAvx2<__m256, eightPixels>(row, step, count, columns, patch + i);
    else
      sampleColumnsAvx2<__m128, fourPixels>(row, step, count, columns, patch + i);
    const int done = eight ? 8 : 4;
    i += done, row.upper += done, row.lower += done;
  }
}
#endif

/// std::floor of what an int can hold.
int floorOf(float value) {
  const int truncated = static_cast<int>(value);
  return truncated - static_cast<int>(static_cast<float>(truncated) > value);
}

/// A row that begins at `start`, of a patch that lies `b` px below `upper`.
SampledRow rowAt(const std::uint8_t* upper, std::size_t step, float start, float b) {
  const int column = floorOf(start);
  const float a = start - static_cast<float>(column);
  upper += column;
  return {upper, upper + step, (1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
}

}  // namespace

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch) {
  const int row = floorOf(y), count = 2 * radius + 1;
  const float b = y - static_cast<float>(row);
  const std::size_t step = image.step[0];
  const std::uint8_t* first = image.ptr(row - radius + margin) - radius + margin;
#ifdef SDVO_HAVE_AVX2
  if (slant == 0.f && usesAvx2() && columns % 4 == 0)
    return sampleUprightAvx2(rowAt(first, step, x, b), static_cast<std::ptrdiff_t>(step), count, columns, patch);
#endif
  std::array<SampledRow, 2 * kLargestPatchRadius + 1> rows;
  for (int j = -radius; j <= radius; ++j, first += step)
    rows[static_cast<std::size_t>(j + radius)] = rowAt(first, step, x - slant * static_cast<float>(j), b);
#ifdef SDVO_HAVE_AVX2
  if (usesAvx2()) return sampleAvx2(rows.data(), count, columns, patch);
#endif
  samplePlain(rows.data(), count, columns, patch);
}

}  // namespace sdvo
