#include "stereo_descriptor_vo/front_end/corner_refiner.hpp"

#include <algorithm>
#include <cmath>

#include "../common/lanes.hpp"
#include "stereo_descriptor_vo/front_end/image_margin.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

namespace sdvo {
namespace {

/// Weighted sums of the gradients' products, and of their products with the offset (x, y).
template <class Vector>
struct GradientSums {
  Vector xx{}, xy{}, yy{}, along_x{}, along_y{};
};

struct SumGradients {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const float* centre, int stride, const float* weight, const float* x, const float* y,
                                 GradientSums<Vector>& sums) {
    Vector right, left, below, above, w, dx, dy;
    load(centre + 1, right), load(centre - 1, left), load(centre + stride, below), load(centre - stride, above);
    load(weight, w), load(x, dx), load(y, dy);
    const Vector gx = right - left, gy = below - above;
    const Vector xx = w * gx * gx, xy = w * gx * gy, yy = w * gy * gy;
    sums.xx += xx, sums.xy += xy, sums.yy += yy;
    sums.along_x += xx * dx + xy * dy, sums.along_y += xy * dx + yy * dy;
  }

  static SDVO_IN_KERNEL void run(const float* patch, int stride, int count, const float* weight, const float* x,
                                 const float* y, GradientSums<float>* sums) {
    const float* centre = patch + stride + 1;
    GradientSums<Lanes> whole;
    GradientSums<HalfLanes> rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) add(centre + i, stride, weight + i, x + i, y + i, whole);
    if (i < count) add(centre + i, stride, weight + i, x + i, y + i, rest);
    *sums = {sumOf(whole.xx, rest.xx), sumOf(whole.xy, rest.xy), sumOf(whole.yy, rest.yy),
             sumOf(whole.along_x, rest.along_x), sumOf(whole.along_y, rest.along_y)};
  }
};

}  // namespace

CornerRefiner::CornerRefiner(const cv::Mat& image, int radius, int clearance, cv::Mat& scratch)
    : radius_(radius), margin_(0), image_(image) {
  const int reach = stride() + 1;  // px that are read beside a start
  if (clearance < reach) {
    addMargin(image, reach, scratch);
    image_ = scratch, margin_ = reach;
  }
  // Weights fall off from the centre; they are zero beyond the square, where a patch's rows go on.
  const int rows = 2 * radius + 1;
  for (auto* values : {&weight_, &x_, &y_}) values->assign(static_cast<std::size_t>(rows * stride()), 0.f);
  for (int y = -radius; y <= radius; ++y)
    for (int x = -radius; x <= radius; ++x) {
      const std::size_t i = static_cast<std::size_t>((y + radius) * stride() + x + radius);
      weight_[i] = std::exp(-static_cast<float>(x * x + y * y) / static_cast<float>(radius * radius));
      x_[i] = static_cast<float>(x);
      y_[i] = static_cast<float>(y);
    }
}

int CornerRefiner::stride() const {
  return patchStride(radius_ + 1);
}

std::optional<cv::Point2f> CornerRefiner::refine(const cv::Point2f& start, float largest_shift) const {
  constexpr int kIterations = 10;
  constexpr float kConverged = 0.02f;     // px
  thread_local std::vector<float> patch;  // the square with one pixel more on each side
  patch.resize(weight_.size() + static_cast<std::size_t>(2 * stride() + 2));
  cv::Point2f position = start;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    samplePatch(image_, margin_, position.x, position.y, 0.f, radius_ + 1, stride(), patch.data());
    GradientSums<float> sums;
    runKernel<SumGradients>(patch.data(), stride(), static_cast<int>(weight_.size()), weight_.data(), x_.data(),
                            y_.data(), &sums);
    const auto [a, b, c, along_x, along_y] = sums;
    const float determinant = a * c - b * b;
    if (!(determinant > 1e-6f * a * c)) break;
    const cv::Point2f step((c * along_x - b * along_y) / determinant, (a * along_y - b * along_x) / determinant);
    position += step;
    const cv::Point2f shift = position - start;
    if (!(std::max(std::abs(shift.x), std::abs(shift.y)) <= static_cast<float>(radius_))) return std::nullopt;
    if (step.dot(step) <= kConverged * kConverged) break;
  }
  const cv::Point2f shift = position - start;
  if (std::max(std::abs(shift.x), std::abs(shift.y)) > largest_shift) return std::nullopt;
  return position;
}

}  // namespace sdvo
