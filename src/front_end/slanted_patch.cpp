#include "stereo_descriptor_vo/front_end/slanted_patch.hpp"

#include "../common/patch_products.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

namespace sdvo {
namespace {

/// Rows go on beyond the square: the mask makes the patch and its derivatives zero there, so that whatever is sampled
/// does not count.
struct Differentiate {
  static SDVO_IN_KERNEL void run(const float* wide, int stride, int count, const float* mask, const float* row,
                                 float* grey, float* by_disparity, float* by_dv, float* by_slant) {
    const float* centre = wide + stride + 1;
    int i = 0;
    for (; i + 8 <= count; i += 8)
      part<Lanes>(centre + i, stride, mask + i, row + i, grey + i, by_disparity + i, by_dv + i, by_slant + i);
    if (i < count)
      part<HalfLanes>(centre + i, stride, mask + i, row + i, grey + i, by_disparity + i, by_dv + i, by_slant + i);
  }

  template <class Vector>
  static SDVO_IN_KERNEL void part(const float* centre, int stride, const float* mask, const float* row, float* grey,
                                  float* by_disparity, float* by_dv, float* by_slant) {
    Vector here, right, left, above, below, m, r;
    load(centre, here), load(centre + 1, right), load(centre - 1, left);
    load(centre - stride, above), load(centre + stride, below), load(mask, m), load(row, r);
    const Vector across = 0.5f * (right - left) * m;
    store(Vector(here * m), grey);
    store(across, by_disparity);
    store(Vector(0.5f * (above - below) * m), by_dv);
    store(Vector(across * r), by_slant);
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
  runKernel<Differentiate>(wide_.data(), stride_, count_, mask_.data(), row_.data(), grey_.data(), by_disparity_.data(),
                           by_dv_.data(), by_slant_.data());
  for (auto* values : {&grey_, &by_disparity_, &by_dv_, &by_slant_}) removeMean(*values);
  LaneProducts p;
  runKernel<SumProducts>(count_, by_disparity_.data(), by_dv_.data(), by_slant_.data(), &p);
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
  std::vector<float>& other = difference_;
  for (int i = 0; i < count_; ++i) other[i] = (other[i] + grey_[i]) * mask_[i];
  removeMean(other);
  LaneProducts p;
  runKernel<SumProducts>(count_, grey_.data(), other.data(), mask_.data(), &p);
  return {p.ab, p.aa, p.bb};
}

void SlantedPatch::removeMean(std::vector<float>& values) const {
  runKernel<RemoveMean>(count_, static_cast<float>(pixels()), mask_.data(), values.data());
}

}  // namespace sdvo
