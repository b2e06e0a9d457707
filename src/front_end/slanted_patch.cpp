#include "slanted_patch.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "../common/kernel.hpp"

// Compilers unpack bytes to floats by more than twice the instructions of these.
#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#define SDVO_SAMPLER SDVO_AVX2
#elif defined(SDVO_HAVE_NEON)
#include <arm_neon.h>

#include <cstring>
#define SDVO_SAMPLER
#endif

namespace sdvo {
namespace {

/// std::floor of what an int can hold.
SDVO_IN_KERNEL int floorOf(float value) {
  const int truncated = static_cast<int>(value);
  return truncated - static_cast<int>(static_cast<float>(truncated) > value);
}

/// Where the rows of a patch begin. The four pixels around a position weigh the same all along a row.
struct Places {
  std::array<int, kPatchStride> column;
  std::array<float, kPatchStride> w00, w01, w10, w11;
};

/// `below`: how far the rows of the patch lie below those of the image, px.
struct PlaceRows {
  static SDVO_IN_KERNEL void run(float x, float below, float slant, int radius, Places* places) {
    for (int j = 0; j < kPatchStride; ++j) {
      const float start = x - slant * static_cast<float>(j - radius);
      const int column = floorOf(start);
      const float a = start - static_cast<float>(column), b = below;
      places->column[j] = column;
      places->w00[j] = (1 - a) * (1 - b), places->w01[j] = a * (1 - b);
      places->w10[j] = (1 - a) * b, places->w11[j] = a * b;
    }
  }
};

void samplePlain(const std::uint8_t* image, std::size_t step, const Places& places, int rows, float* patch) {
  for (int j = 0; j < rows; ++j, image += step, patch += kPatchStride) {
    const std::uint8_t *upper = image + places.column[j], *lower = upper + step;
    for (int i = 0; i < kPatchStride; ++i)
      patch[i] = places.w00[j] * upper[i] + places.w01[j] * upper[i + 1] + places.w10[j] * lower[i] +
                 places.w11[j] * lower[i + 1];
  }
}

#ifdef SDVO_HAVE_AVX2
SDVO_SAMPLER inline Lanes eightPixels(const std::uint8_t* pixels) {
  return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(pixels))));
}
#elif defined(SDVO_HAVE_NEON)
inline Lanes eightPixels(const std::uint8_t* pixels) {
  const uint16x8_t words = vmovl_u8(vld1_u8(pixels));
  const float32x4_t halves[] = {vcvtq_f32_u32(vmovl_u16(vget_low_u16(words))),
                                vcvtq_f32_u32(vmovl_u16(vget_high_u16(words)))};
  Lanes lanes;
  std::memcpy(&lanes, halves, sizeof lanes);
  return lanes;
}
#endif

#ifdef SDVO_SAMPLER
/// The same operations in the same order, eight columns at once.
SDVO_SAMPLER void sampleWithVectors(const std::uint8_t* image, std::size_t step, const Places& places, int rows,
                                    float* patch) {
  for (int j = 0; j < rows; ++j, image += step, patch += kPatchStride) {
    const std::uint8_t *upper = image + places.column[j], *lower = upper + step;
    for (int i = 0; i < kPatchStride; i += 8)
      store(places.w00[j] * eightPixels(upper + i) + places.w01[j] * eightPixels(upper + i + 1) +
                places.w10[j] * eightPixels(lower + i) + places.w11[j] * eightPixels(lower + i + 1),
            patch + i);
  }
}
#endif

/// Sums over the patch, or over products with it.
struct LayerSums {
  float grey, by_disparity, by_dv, by_slant;
};

/// Also sums up the layers, and the products of the derivatives with each other. Rows go on beyond the square: the mask
/// makes the patch and its derivatives zero there, so that whatever is sampled does not count.
struct Differentiate {
  static SDVO_IN_KERNEL void run(const float* wide, const float* mask, const float* row, SlantedPatch::Layers* layers,
                                 LayerSums* sums, Products<float>* products) {
    Lanes grey_sum{}, disparity_sum{}, dv_sum{}, slant_sum{};
    Products<Lanes> sums_of_products;
    for (int i = 0; i < SlantedPatch::kCount; i += 8) {
      const float* centre = wide + kPatchStride + 1 + i;
      Lanes here, right, left, above, below, m, r;
      load(centre, here), load(centre + 1, right), load(centre - 1, left);
      load(centre - kPatchStride, above), load(centre + kPatchStride, below), load(mask + i, m), load(row + i, r);
      const Lanes grey = here * m, across = 0.5f * (right - left) * m;
      const Lanes down = 0.5f * (above - below) * m, slanted = across * r;
      store(grey, &layers->grey[i]), store(across, &layers->by_disparity[i]);
      store(down, &layers->by_dv[i]), store(slanted, &layers->by_slant[i]);
      grey_sum += grey, disparity_sum += across, dv_sum += down, slant_sum += slanted;
      sums_of_products.add(across, down, slanted);
    }
    *sums = {sumOf(grey_sum), sumOf(disparity_sum), sumOf(dv_sum), sumOf(slant_sum)};
    *products = sumOf(sums_of_products);
  }
};

/// Makes `other` the difference other - grey and gives its sum within the mask and its products with the derivatives.
struct ProjectDifference {
  static SDVO_IN_KERNEL void run(const SlantedPatch::Layers* layers, const float* mask, float* other, LayerSums* sums) {
    Lanes grey{}, by_disparity{}, by_dv{}, by_slant{};
    for (int i = 0; i < SlantedPatch::kCount; i += 8) {
      Lanes o, g, m, u, v, w;
      load(other + i, o), load(&layers->grey[i], g), load(mask + i, m);
      load(&layers->by_disparity[i], u), load(&layers->by_dv[i], v), load(&layers->by_slant[i], w);
      o -= g;
      store(o, other + i);
      grey += m * o, by_disparity += u * o, by_dv += v * o, by_slant += w * o;
    }
    *sums = {sumOf(grey), sumOf(by_disparity), sumOf(by_dv), sumOf(by_slant)};
  }
};

/// Sums of the other image, of its products with the patch, and of both squares.
struct GreySums {
  float other, product, square, other_square;
};

/// Makes the difference an image again and multiplies it with the patch and with itself.
struct CompareGrey {
  static SDVO_IN_KERNEL void run(const float* grey, const float* mask, const float* difference, GreySums* sums) {
    Lanes other{}, product{}, square{}, other_square{};
    for (int i = 0; i < SlantedPatch::kCount; i += 8) {
      Lanes o, g, m;
      load(difference + i, o), load(grey + i, g), load(mask + i, m);
      o = (o + g) * m;
      other += o, product += g * o, square += g * g, other_square += o * o;
    }
    *sums = {sumOf(other), sumOf(product), sumOf(square), sumOf(other_square)};
  }
};

}  // namespace

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, float* patch) {
  CV_Assert(2 * radius + 1 < kPatchStride);
  const int row = floorOf(y), rows = 2 * radius + 1;
  const std::uint8_t* first = image.ptr(row - radius + margin) - radius + margin;
  Places places;
  runKernel<PlaceRows>(x, y - static_cast<float>(row), slant, radius, &places);
#ifdef SDVO_SAMPLER
  if (usesVectorKernels()) return sampleWithVectors(first, image.step[0], places, rows, patch);
#endif
  samplePlain(first, image.step[0], places, rows, patch);
}

SlantedPatch::SlantedPatch() {
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const std::size_t k = static_cast<std::size_t>(j * kPatchStride + i);
      mask_[k] = 1.f, row_[k] = static_cast<float>(j - kRadius);
    }
}

void SlantedPatch::take(const cv::Mat& image, int margin, float x, float y) {
  // The square with one pixel more on each side. The lanes beyond its last row are masked.
  std::array<float, kCount + 2 * kPatchStride + 2> wide;
  std::fill(wide.end() - 2, wide.end(), 0.f);
  samplePatch(image, margin, x, y, 0.f, kRadius + 1, wide.data());
  LayerSums sums;
  Products<float> p;
  runKernel<Differentiate>(wide.data(), mask_.data(), row_.data(), &layers_, &sums, &p);
  grey_sum_ = sums.grey;
  mean_ = Eigen::Vector3f(sums.by_disparity, sums.by_dv, sums.by_slant) / float{kPixels};
  hessian_ << p.aa, p.ab, p.ac, p.ab, p.bb, p.bc, p.ac, p.bc, p.cc;
  hessian_ -= float{kPixels} * mean_ * mean_.transpose();
}

Eigen::Vector3f SlantedPatch::compare(const cv::Mat& image, int margin, float x, float y, float slant) {
  samplePatch(image, margin, x, y, slant, kRadius, difference_.data());
  LayerSums sums;
  runKernel<ProjectDifference>(&layers_, mask_.data(), difference_.data(), &sums);
  return Eigen::Vector3f(sums.by_disparity, sums.by_dv, sums.by_slant) - sums.grey * mean_;
}

SlantedPatch::Similarity SlantedPatch::similarity() {
  GreySums sums;
  runKernel<CompareGrey>(layers_.grey.data(), mask_.data(), difference_.data(), &sums);
  const float mean = grey_sum_ / float{kPixels}, other_mean = sums.other / float{kPixels};
  return {sums.product - mean * sums.other, sums.square - mean * grey_sum_,
          sums.other_square - other_mean * sums.other};
}

}  // namespace sdvo
