#include "slanted_patch.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "../common/kernel.hpp"
#include "../common/patch_products.hpp"
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
struct RowPlace {
  int column;
  float w00, w01, w10, w11;
};

/// Of a row that begins at `start`, of a patch whose rows lie `b` px below those of the image.
SDVO_IN_KERNEL RowPlace placeAt(float start, float b) {
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
SDVO_VECTORS inline void sampleRow(const std::uint8_t* upper, const std::uint8_t* lower, RowPlace place,
                                   float* values) {
  const Vector sum = place.w00 * kPixels(upper) + place.w01 * kPixels(upper + 1) + place.w10 * kPixels(lower) +
                     place.w11 * kPixels(lower + 1);
  std::memcpy(values, &sum, sizeof sum);
}

SDVO_VECTORS void sampleWithVectors(const std::uint8_t* image, std::size_t step, const Places& places, int count,
                                    int columns, float* patch) {
  for (int j = 0; j < count; ++j, image += step, patch += columns) {
    const RowPlace place{places.column[j], places.w00[j], places.w01[j], places.w10[j], places.w11[j]};
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
SDVO_VECTORS inline void sampleColumns(const std::uint8_t* upper, std::size_t step, RowPlace place, int count,
                                       int columns, float* patch) {
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
SDVO_VECTORS void sampleUpright(const std::uint8_t* image, std::size_t step, RowPlace place, int count, int columns,
                                float* patch) {
  image += place.column;
  int i = 0;
  for (; i + 8 <= columns; i += 8) sampleColumns<Lanes, eightPixels>(image + i, step, place, count, columns, patch + i);
  if (i < columns) sampleColumns<HalfLanes, fourPixels>(image + i, step, place, count, columns, patch + i);
}
#endif

/// The patch and its derivatives by disparity, dv and slant.
struct Layers {
  float *grey, *by_disparity, *by_dv, *by_slant;
};

/// A value of each of them.
template <class Number>
struct LayerValues {
  Number grey{}, by_disparity{}, by_dv{}, by_slant{};
};

SDVO_IN_KERNEL LayerValues<float> summed(const LayerValues<Lanes>& whole, const LayerValues<HalfLanes>& rest) {
  return {sumOf(whole.grey, rest.grey), sumOf(whole.by_disparity, rest.by_disparity), sumOf(whole.by_dv, rest.by_dv),
          sumOf(whole.by_slant, rest.by_slant)};
}

/// Also sums up the layers, and the products of the derivatives with each other. Rows go on beyond the square: the mask
/// makes the patch and its derivatives zero there, so that whatever is sampled does not count.
struct Differentiate {
  static SDVO_IN_KERNEL void run(const float* wide, int stride, int count, const float* mask, const float* row,
                                 Layers layers, LayerValues<float>* sums, LaneProducts* products) {
    const float* centre = wide + stride + 1;
    LayerValues<Lanes> whole;
    LayerValues<HalfLanes> rest;
    Products<Lanes> of_whole;
    Products<HalfLanes> of_rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) part(centre + i, stride, mask + i, row + i, i, layers, whole, of_whole);
    if (i < count) part(centre + i, stride, mask + i, row + i, i, layers, rest, of_rest);
    *sums = summed(whole, rest);
    *products = sumOf(of_whole, of_rest);
  }

  template <class Vector>
  static SDVO_IN_KERNEL void part(const float* centre, int stride, const float* mask, const float* row, int i,
                                  const Layers& layers, LayerValues<Vector>& sums, Products<Vector>& products) {
    Vector here, right, left, above, below, m, r;
    load(centre, here), load(centre + 1, right), load(centre - 1, left);
    load(centre - stride, above), load(centre + stride, below), load(mask, m), load(row, r);
    const Vector grey = here * m, across = 0.5f * (right - left) * m;
    const Vector down = 0.5f * (above - below) * m, slanted = across * r;
    store(grey, layers.grey + i), store(across, layers.by_disparity + i);
    store(down, layers.by_dv + i), store(slanted, layers.by_slant + i);
    sums.grey += grey, sums.by_disparity += across, sums.by_dv += down, sums.by_slant += slanted;
    products.add(across, down, slanted);
  }
};

/// Makes `other` the difference other - grey and gives its sum within the mask and its products with the derivatives.
struct ProjectDifference {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const Layers& layers, const float* mask, int i, float* other,
                                 LayerValues<Vector>& sums) {
    Vector o, g, m, u, v, w;
    load(other + i, o), load(layers.grey + i, g), load(mask + i, m);
    load(layers.by_disparity + i, u), load(layers.by_dv + i, v), load(layers.by_slant + i, w);
    o -= g;
    store(o, other + i);
    sums.grey += m * o, sums.by_disparity += u * o, sums.by_dv += v * o, sums.by_slant += w * o;
  }

  static SDVO_IN_KERNEL void run(int count, Layers layers, const float* mask, float* other, LayerValues<float>* sums) {
    LayerValues<Lanes> whole;
    LayerValues<HalfLanes> rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) add(layers, mask, i, other, whole);
    if (i < count) add(layers, mask, i, other, rest);
    *sums = summed(whole, rest);
  }
};

/// Makes the difference `other` an image again and multiplies it with the patch and with itself.
struct CompareGrey {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const float* grey, const float* mask, const float* other, Vector& sum, Vector& product,
                                 Vector& square, Vector& other_square) {
    Vector o, g, m;
    load(other, o), load(grey, g), load(mask, m);
    o = (o + g) * m;
    sum += o, product += g * o, square += g * g, other_square += o * o;
  }

  static SDVO_IN_KERNEL void run(int count, const float* grey, const float* mask, const float* other, float* sums) {
    Lanes sum{}, product{}, square{}, other_square{};
    HalfLanes rest_sum{}, rest_product{}, rest_square{}, rest_other{};
    int i = 0;
    for (; i + 8 <= count; i += 8) add(grey + i, mask + i, other + i, sum, product, square, other_square);
    if (i < count) add(grey + i, mask + i, other + i, rest_sum, rest_product, rest_square, rest_other);
    sums[0] = sumOf(sum, rest_sum), sums[1] = sumOf(product, rest_product);
    sums[2] = sumOf(square, rest_square), sums[3] = sumOf(other_square, rest_other);
  }
};

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

SlantedPatch::SlantedPatch(int radius)
    : radius_(radius), stride_(patchStride(radius + 1)), count_((2 * radius + 1) * stride_) {
  const std::size_t size = static_cast<std::size_t>(count_);
  mask_.assign(size, 0.f), row_.assign(size, 0.f);
  for (int j = 0; j < side(); ++j)
    for (int i = 0; i < side(); ++i) {
      const std::size_t k = static_cast<std::size_t>(j * stride_ + i);
      mask_[k] = 1.f, row_[k] = static_cast<float>(j - radius);
    }
  wide_.assign(size + static_cast<std::size_t>(2 * stride_ + 2), 0.f);
  for (auto* values : {&grey_, &by_disparity_, &by_dv_, &by_slant_, &difference_}) values->assign(size, 0.f);
}

void SlantedPatch::take(const cv::Mat& image, int margin, float x, float y) {
  samplePatch(image, margin, x, y, 0.f, radius_ + 1, stride_, wide_.data());
  LayerValues<float> sums;
  LaneProducts p;
  runKernel<Differentiate>(wide_.data(), stride_, count_, mask_.data(), row_.data(),
                           Layers{grey_.data(), by_disparity_.data(), by_dv_.data(), by_slant_.data()}, &sums, &p);
  grey_sum_ = sums.grey;
  mean_ = Eigen::Vector3f(sums.by_disparity, sums.by_dv, sums.by_slant) / static_cast<float>(pixels());
  hessian_ << p.aa, p.ab, p.ac, p.ab, p.bb, p.bc, p.ac, p.bc, p.cc;
  hessian_ -= static_cast<float>(pixels()) * mean_ * mean_.transpose();
}

Eigen::Vector3f SlantedPatch::compare(const cv::Mat& image, int margin, float x, float y, float slant) {
  samplePatch(image, margin, x, y, slant, radius_, stride_, difference_.data());
  LayerValues<float> sums;
  runKernel<ProjectDifference>(count_, Layers{grey_.data(), by_disparity_.data(), by_dv_.data(), by_slant_.data()},
                               mask_.data(), difference_.data(), &sums);
  return Eigen::Vector3f(sums.by_disparity, sums.by_dv, sums.by_slant) - sums.grey * mean_;
}

SlantedPatch::Similarity SlantedPatch::similarity() {
  std::array<float, 4> sums;
  runKernel<CompareGrey>(count_, grey_.data(), mask_.data(), difference_.data(), sums.data());
  const float mean = grey_sum_ / static_cast<float>(pixels()), other_mean = sums[0] / static_cast<float>(pixels());
  return {sums[1] - mean * sums[0], sums[2] - mean * grey_sum_, sums[3] - other_mean * sums[0]};
}

}  // namespace sdvo
