#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "../common/lanes.hpp"
#include "patch_sampling_neon.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

/// std::floor of what an int can hold.
SDVO_IN_KERNEL int floorOf(float value) {
  const int truncated = static_cast<int>(value);
  return truncated - static_cast<int>(static_cast<float>(truncated) > value);
}

/// Where a row of the patch begins. The four pixels around a position weigh the same all along a row.
struct Place {
  int column;
  float w00, w01, w10, w11;
};

/// Of a row that begins at `start`, of a patch whose rows lie `b` px below those of the image.
SDVO_IN_KERNEL Place placeAt(float start, float b) {
  const int column = floorOf(start);
  const float a = start - static_cast<float>(column);
  return {column, (1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
}

constexpr int kMostRows = (2 * kLargestPatchRadius + 1 + 7) / 8 * 8;  // whole registers

/// Places of all rows of a patch.
struct Places {
  int column[kMostRows];
  float w00[kMostRows], w01[kMostRows], w10[kMostRows], w11[kMostRows];
};

struct PlaceRows {
  static SDVO_IN_KERNEL void run(float x, float b, float slant, int radius, Places* places) {
    const int rounded = (2 * radius + 1 + 7) / 8 * 8;
    for (int j = 0; j < rounded; ++j) {
      const auto [column, w00, w01, w10, w11] = placeAt(x - slant * static_cast<float>(j - radius), b);
      places->column[j] = column;
      places->w00[j] = w00, places->w01[j] = w01, places->w10[j] = w10, places->w11[j] = w11;
    }
  }
};

void samplePlain(const std::uint8_t* image, std::size_t step, const Places& places, int count, int columns,
                 float* patch) {
  for (int j = 0; j < count; ++j, image += step, patch += columns) {
    const std::uint8_t *upper = image + places.column[j], *lower = upper + step;
    for (int i = 0; i < columns; ++i)
      patch[i] = places.w00[j] * upper[i] + places.w01[j] * upper[i + 1] + places.w10[j] * lower[i] +
                 places.w11[j] * lower[i + 1];
  }
}

#ifdef SDVO_HAVE_AVX2
SDVO_AVX2 inline Lanes eightPixels(const std::uint8_t* pixels) {
  return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(pixels))));
}

SDVO_AVX2 inline HalfLanes fourPixels(const std::uint8_t* pixels) {
  int four;
  std::memcpy(&four, pixels, sizeof four);
  return _mm_cvtepi32_ps(_mm_cvtepu8_epi32(_mm_cvtsi32_si128(four)));
}
#endif

#ifdef SDVO_HAVE_VECTORS
/// The same operations in the same order, eight columns at once, and the last ones one by one.
template <class Vector, Vector (*kPixels)(const std::uint8_t*)>
SDVO_VECTORS inline void sampleRow(const std::uint8_t* upper, const std::uint8_t* lower, Place place, float* values) {
  const Vector sum = place.w00 * kPixels(upper) + place.w01 * kPixels(upper + 1) + place.w10 * kPixels(lower) +
                     place.w11 * kPixels(lower + 1);
  std::memcpy(values, &sum, sizeof sum);
}

SDVO_VECTORS void sampleWithVectors(const std::uint8_t* image, std::size_t step, const Places& places, int count,
                                    int columns, float* patch) {
  for (int j = 0; j < count; ++j, image += step, patch += columns) {
    const Place place{places.column[j], places.w00[j], places.w01[j], places.w10[j], places.w11[j]};
    const std::uint8_t *upper = image + place.column, *lower = upper + step;
    int i = 0;
    for (; i + 8 <= columns; i += 8) sampleRow<Lanes, eightPixels>(upper + i, lower + i, place, patch + i);
    if (i + 4 <= columns) sampleRow<HalfLanes, fourPixels>(upper + i, lower + i, place, patch + i), i += 4;
    for (; i < columns; ++i)
      patch[i] = place.w00 * upper[i] + place.w01 * upper[i + 1] + place.w10 * lower[i] + place.w11 * lower[i + 1];
  }
}

/// Eight or four columns of rows that lie right below each other: what is the lower row of one is the upper one of the
/// next.
template <class Vector, Vector (*kPixels)(const std::uint8_t*)>
SDVO_VECTORS inline void sampleColumns(const std::uint8_t* upper, std::size_t step, Place place, int count, int columns,
                                       float* patch) {
  Vector a = kPixels(upper), b = kPixels(upper + 1);
  const std::uint8_t* lower = upper + step;
  for (int j = 0; j < count; ++j, lower += step, patch += columns) {
    const Vector c = kPixels(lower), d = kPixels(lower + 1);
    const Vector sum = place.w00 * a + place.w01 * b + place.w10 * c + place.w11 * d;
    std::memcpy(patch, &sum, sizeof sum);
    a = c, b = d;
  }
}

/// For a number of columns that is a multiple of four.
SDVO_VECTORS void sampleUpright(const std::uint8_t* image, std::size_t step, Place place, int count, int columns,
                                float* patch) {
  image += place.column;
  int i = 0;
  for (; i + 8 <= columns; i += 8) sampleColumns<Lanes, eightPixels>(image + i, step, place, count, columns, patch + i);
  if (i < columns) sampleColumns<HalfLanes, fourPixels>(image + i, step, place, count, columns, patch + i);
}
#endif

}  // namespace

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch) {
  const int row = floorOf(y), count = 2 * radius + 1;
  const float b = y - static_cast<float>(row);
  const std::size_t step = image.step[0];
  const std::uint8_t* first = image.ptr(row - radius + margin) - radius + margin;
#ifdef SDVO_HAVE_VECTORS
  if (slant == 0.f && usesVectorKernels() && columns % 4 == 0)
    return sampleUpright(first, step, placeAt(x, b), count, columns, patch);
#endif
  Places places;
  runKernel<PlaceRows>(x, b, slant, radius, &places);
#ifdef SDVO_HAVE_VECTORS
  if (usesVectorKernels()) return sampleWithVectors(first, step, places, count, columns, patch);
#endif
  samplePlain(first, step, places, count, columns, patch);
}

}  // namespace sdvo
