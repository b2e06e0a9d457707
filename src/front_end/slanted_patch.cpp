#include "stereo_descriptor_vo/front_end/slanted_patch.hpp"

#include <array>

#include "../common/patch_products.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

namespace sdvo {
namespace {

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
