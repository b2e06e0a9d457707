#include "image_copies.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

namespace sdvo {
namespace {

/// Weights of pixels 2 k - 1, 2 k and 2 k + 1 in pixel k of the half image. An odd size has slightly less than two
/// pixels for each of the half's, so the interval of pixel k begins in the middle of a pixel.
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

/// `pixels` may be read one before the first and one after the last.
void halveRow(const float* pixels, const Shares& columns, std::vector<float>& half) {
  for (int k = 0; k < static_cast<int>(half.size()); ++k)
    half[k] =
        pixels[2 * k - 1] * columns.before[k] + pixels[2 * k] * columns.here[k] + pixels[2 * k + 1] * columns.after[k];
}

}  // namespace

void halveImage(const cv::Mat& image, cv::Mat& half) {
  CV_Assert(image.type() == CV_8UC1);
  const cv::Size size((image.cols + 1) / 2, (image.rows + 1) / 2);
  if (image.cols % 2 == 0 && image.rows % 2 == 0) return cv::resize(image, half, size, 0.0, 0.0, cv::INTER_AREA);

  const Shares columns(image.cols), rows(image.rows);
  const std::size_t width = static_cast<std::size_t>(size.width);
  std::vector<float> pixels(2 * width + 2, 0.f), above(width, 0.f), middle(width), below(width);
  const auto halve = [&](int row, std::vector<float>& result) {
    if (row >= image.rows) return std::fill(result.begin(), result.end(), 0.f);
    std::copy_n(image.ptr(row), image.cols, pixels.begin() + 1);
    halveRow(pixels.data() + 1, columns, result);
  };
  half.create(size, CV_8U);
  for (int k = 0; k < size.height; ++k) {
    halve(2 * k, middle);
    halve(2 * k + 1, below);
    const float share_above = rows.before[k], share_middle = rows.here[k], share_below = rows.after[k];
    std::uint8_t* result = half.ptr(k);
    for (std::size_t i = 0; i < width; ++i)
      result[i] =
          cv::saturate_cast<std::uint8_t>(above[i] * share_above + middle[i] * share_middle + below[i] * share_below);
    std::swap(above, below);
  }
}

void addMargin(const cv::Mat& image, int margin, cv::Mat& larger) {
  CV_Assert(image.type() == CV_8UC1 && !image.empty());
  larger.create(image.rows + 2 * margin, image.cols + 2 * margin, CV_8U);
  const std::size_t beside = static_cast<std::size_t>(margin), columns = static_cast<std::size_t>(image.cols);
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr(y);
    std::uint8_t* to = larger.ptr(y + margin);
    std::memset(to, row[0], beside);
    std::memcpy(to + beside, row, columns);
    std::memset(to + beside + columns, row[columns - 1], beside);
  }
  const int last = margin + image.rows - 1;
  for (int k = 1; k <= margin; ++k) {
    std::memcpy(larger.ptr(margin - k), larger.ptr(margin), columns + 2 * beside);
    std::memcpy(larger.ptr(last + k), larger.ptr(last), columns + 2 * beside);
  }
}

}  // namespace sdvo
