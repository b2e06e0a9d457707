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

/// Rows go on beyond the square: the mask makes the patch and its derivatives zero there, so that whatever is sampled
/// does not count.
struct Differentiate {
  static SDVO_IN_KERNEL void run(const float* wide, int stride, int count, const float* mask, const float* row,
                                 Layers layers, LayerValues<float>* sums) {
    const float* centre = wide + stride + 1;
    LayerValues<Lanes> whole;
    LayerValues<HalfLanes> rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) part(centre + i, stride, mask + i, row + i, i, layers, whole);
    if (i < count) part(centre + i, stride, mask + i, row + i, i, layers, rest);
    *sums = {sumOf(whole.grey, rest.grey), sumOf(whole.by_disparity, rest.by_disparity), sumOf(whole.by_dv, rest.by_dv),
             sumOf(whole.by_slant, rest.by_slant)};
  }

  template <class Vector>
  static SDVO_IN_KERNEL void part(const float* centre, int stride, const float* mask, const float* row, int i,
                                  const Layers& layers, LayerValues<Vector>& sums) {
    Vector here, right, left, above, below, m, r;
    load(centre, here), load(centre + 1, right), load(centre - 1, left);
    load(centre - stride, above), load(centre + stride, below), load(mask, m), load(row, r);
    const Vector grey = here * m, across = 0.5f * (right - left) * m;
    const Vector down = 0.5f * (above - below) * m, slanted = across * r;
    store(grey, layers.grey + i), store(across, layers.by_disparity + i);
    store(down, layers.by_dv + i), store(slanted, layers.by_slant + i);
    sums.grey += grey, sums.by_disparity += across, sums.by_dv += down, sums.by_slant += slanted;
  }
};

template <class Vector>
SDVO_IN_KERNEL void takeAway(float mean, const Vector& mask, float* values, Vector& centred) {
  load(values, centred);
  centred -= mean * mask;
  store(centred, values);
}

/// Takes the means away within the mask and multiplies the derivatives with each other.
struct Centre {
  static SDVO_IN_KERNEL void run(int count, const float* mask, LayerValues<float> means, Layers layers,
                                 LaneProducts* products) {
    Products<Lanes> whole;
    Products<HalfLanes> rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) part(mask + i, means, i, layers, whole);
    if (i < count) part(mask + i, means, i, layers, rest);
    *products = sumOf(whole, rest);
  }

  template <class Vector>
  static SDVO_IN_KERNEL void part(const float* mask, const LayerValues<float>& means, int i, const Layers& layers,
                                  Products<Vector>& products) {
    Vector m, grey, across, down, slanted;
    load(mask, m);
    takeAway(means.grey, m, layers.grey + i, grey);
    takeAway(means.by_disparity, m, layers.by_disparity + i, across);
    takeAway(means.by_dv, m, layers.by_dv + i, down);
    takeAway(means.by_slant, m, layers.by_slant + i, slanted);
    products.add(across, down, slanted);
  }
};

/// Makes `other` the difference other - grey and multiplies it with a, b and c.
struct ProjectDifference {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const float* grey, const float* a, const float* b, const float* c, float* other,
                                 Vector& by_a, Vector& by_b, Vector& by_c) {
    Vector o, g, u, v, w;
    load(other, o), load(grey, g), load(a, u), load(b, v), load(c, w);
    o -= g;
    store(o, other);
    by_a += u * o, by_b += v * o, by_c += w * o;
  }

  static SDVO_IN_KERNEL void run(int count, const float* grey, const float* a, const float* b, const float* c,
                                 float* other, float* products) {
    Lanes by_a{}, by_b{}, by_c{};
    HalfLanes rest_a{}, rest_b{}, rest_c{};
    int i = 0;
    for (; i + 8 <= count; i += 8) add(grey + i, a + i, b + i, c + i, other + i, by_a, by_b, by_c);
    if (i < count) add(grey + i, a + i, b + i, c + i, other + i, rest_a, rest_b, rest_c);
    products[0] = sumOf(by_a, rest_a), products[1] = sumOf(by_b, rest_b), products[2] = sumOf(by_c, rest_c);
  }
};

/// Makes the difference `other` a patch again, without its mean, and multiplies it with the patch: products has
/// grey * other, grey * grey and other * other.
struct CompareGrey {
  template <class Vector>
  static SDVO_IN_KERNEL void restore(const float* grey, const float* mask, float* other, Vector& sum) {
    Vector o, g, m;
    load(other, o), load(grey, g), load(mask, m);
    o = (o + g) * m;
    store(o, other);
    sum += o;
  }
  template <class Vector>
  static SDVO_IN_KERNEL void multiply(const float* grey, const float* mask, float mean, float* other, Vector& product,
                                      Vector& square, Vector& other_square) {
    Vector o, g, m;
    load(grey, g), load(mask, m);
    takeAway(mean, m, other, o);
    product += g * o, square += g * g, other_square += o * o;
  }

  static SDVO_IN_KERNEL void run(int count, float pixels, const float* grey, const float* mask, float* other,
                                 float* products) {
    Lanes sum{}, product{}, square{}, other_square{};
    HalfLanes rest_sum{}, rest_product{}, rest_square{}, rest_other{};
    int i = 0;
    for (; i + 8 <= count; i += 8) restore(grey + i, mask + i, other + i, sum);
    if (i < count) restore(grey + i, mask + i, other + i, rest_sum);
    const float mean = sumOf(sum, rest_sum) / pixels;
    for (i = 0; i + 8 <= count; i += 8) multiply(grey + i, mask + i, mean, other + i, product, square, other_square);
    if (i < count) multiply(grey + i, mask + i, mean, other + i, rest_product, rest_square, rest_other);
    products[0] = sumOf(product, rest_product), products[1] = sumOf(square, rest_square);
    products[2] = sumOf(other_square, rest_other);
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
  const Layers layers{grey_.data(), by_disparity_.data(), by_dv_.data(), by_slant_.data()};
  LayerValues<float> sums;
  runKernel<Differentiate>(wide_.data(), stride_, count_, mask_.data(), row_.data(), layers, &sums);
  const float count = static_cast<float>(pixels());
  const LayerValues<float> means{sums.grey / count, sums.by_disparity / count, sums.by_dv / count,
                                 sums.by_slant / count};
  LaneProducts p;
  runKernel<Centre>(count_, mask_.data(), means, layers, &p);
  hessian_ << p.aa, p.ab, p.ac, p.ab, p.bb, p.bc, p.ac, p.bc, p.cc;
}

Eigen::Vector3f SlantedPatch::compare(const cv::Mat& image, int margin, float x, float y, float slant) {
  samplePatch(image, margin, x, y, slant, radius_, stride_, difference_.data());
  Eigen::Vector3f products;
  // The derivatives have no mean, so that of the difference drops out.
  runKernel<ProjectDifference>(count_, grey_.data(), by_disparity_.data(), by_dv_.data(), by_slant_.data(),
                               difference_.data(), products.data());
  return products;
}

SlantedPatch::Similarity SlantedPatch::similarity() {
  std::array<float, 3> products;
  runKernel<CompareGrey>(count_, static_cast<float>(pixels()), grey_.data(), mask_.data(), difference_.data(),
                         products.data());
  return {products[0], products[1], products[2]};
}

}  // namespace sdvo
