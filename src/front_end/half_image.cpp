#include "stereo_descriptor_vo/front_end/half_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "../common/kernel.hpp"

namespace sdvo {
namespace {

/// What pixels 2 k - 1, 2 k and 2 k + 1 contribute to pixel k of the half: where there are less than two of them for
/// each, it begins within the first.
struct Shares {
  std::vector<float> before, here, after;

  explicit Shares(int size) {
    constexpr double kNothing = 1e-3;  // of a pixel
    const int half = (size + 1) / 2;
    for (auto* shares : {&before, &here, &after}) shares->reserve(static_cast<std::size_t>(half));
    const double width = static_cast<double>(size) / half;
    for (int k = 0; k < half; ++k) {
      const double begin = k * width, end = begin + width, covered = std::min(width, size - begin);
      const double first = std::max(2.0 * k - begin, 0.0), last = std::min(end - (2 * k + 1), 1.0);
      before.push_back(first > kNothing ? static_cast<float>(first / covered) : 0.f);
      here.push_back(static_cast<float>(1.0 / covered));
      after.push_back(last > kNothing ? static_cast<float>(std::min(last, covered) / covered) : 0.f);
    }
  }
};

struct HalveRow {
  /// `pixels` may be read one before the first and one after the last.
  static SDVO_IN_KERNEL void run(const float* pixels, const float* before, const float* here, const float* after,
                                 int count, float* half) {
    for (int k = 0; k < count; ++k)
      half[k] = pixels[2 * k - 1] * before[k] + pixels[2 * k] * here[k] + pixels[2 * k + 1] * after[k];
  }
};

/// Also rounds to the nearest whole number, the even one of two, as cv::saturate_cast has it: means lie within 0…255
/// but for their own rounding.
struct AddRows {
  static SDVO_IN_KERNEL void run(const float* above, const float* middle, const float* below, float share_above,
                                 float share_middle, float share_below, int count, std::uint8_t* half) {
    constexpr float kUnitsOnly = 12582912.f;  // 1.5 * 2^23: what is added to it loses its fraction
    for (int k = 0; k < count; ++k) {
      const float sum = above[k] * share_above + middle[k] * share_middle + below[k] * share_below;
      half[k] = static_cast<std::uint8_t>(static_cast<int>((sum + kUnitsOnly) - kUnitsOnly));
    }
  }
};

struct ToFloat {
  static SDVO_IN_KERNEL void run(const std::uint8_t* pixels, int count, float* values) {
    for (int k = 0; k < count; ++k) values[k] = static_cast<float>(pixels[k]);
  }
};

}  // namespace

void halveImage(const cv::Mat& image, cv::Mat& half) {
  CV_Assert(image.type() == CV_8UC1);
  const cv::Size size((image.cols + 1) / 2, (image.rows + 1) / 2);
  if (image.cols % 2 == 0 && image.rows % 2 == 0) return cv::resize(image, half, size, 0.0, 0.0, cv::INTER_AREA);

  const Shares columns(image.cols), rows(image.rows);
  const std::size_t width = static_cast<std::size_t>(size.width);
  std::vector<float> pixels(2 * width + 2, 0.f), above(width, 0.f), middle(width), below(width);
  const auto halveRow = [&](int row, std::vector<float>& result) {
    if (row >= image.rows) return std::fill(result.begin(), result.end(), 0.f);
    runKernel<ToFloat>(image.ptr(row), image.cols, pixels.data() + 1);
    runKernel<HalveRow>(pixels.data() + 1, columns.before.data(), columns.here.data(), columns.after.data(), size.width,
                        result.data());
  };
  half.create(size, CV_8U);
  for (int k = 0; k < size.height; ++k) {
    halveRow(2 * k, middle);
    halveRow(2 * k + 1, below);
    const std::size_t row = static_cast<std::size_t>(k);
    runKernel<AddRows>(above.data(), middle.data(), below.data(), rows.before[row], rows.here[row], rows.after[row],
                       size.width, half.ptr(k));
    std::swap(above, below);
  }
}

}  // namespace sdvo
