#include "stereo_descriptor_vo/front_end/exposure_balance.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace sdvo {
namespace {

constexpr int kLevels = 256;

/// How many pixels of every second row are darker than each level or just as dark.
std::array<int, kLevels> cumulativeHistogram(const cv::Mat& image) {
  std::array<int, kLevels> counts{};
  for (int y = 0; y < image.rows; y += 2) {
    const std::uint8_t* row = image.ptr(y);
    for (int x = 0; x < image.cols; ++x) ++counts[row[x]];
  }
  for (int level = 1; level < kLevels; ++level) counts[level] += counts[level - 1];
  return counts;
}

/// `image` with the grey levels of `model`.
cv::Mat withLevelsOf(const cv::Mat& model, const cv::Mat& image) {
  const auto of_image = cumulativeHistogram(image), of_model = cumulativeHistogram(model);
  cv::Mat table(1, kLevels, CV_8U), result;
  int found = 0;
  for (int level = 0; level < kLevels; ++level) {
    // The middle of the level's pixels: a level that holds many of them is none of its two ends.
    const int darker = level > 0 ? of_image[level - 1] : 0;
    const int rank = darker + (of_image[level] - darker) / 2;
    while (found < kLevels - 1 && of_model[found] <= rank) ++found;
    table.at<std::uint8_t>(level) = static_cast<std::uint8_t>(found);
  }
  cv::LUT(image, table, result);
  return result;
}

}  // namespace

void ExposureBalance::apply(double left_mean, double right_mean, cv::Mat& left, cv::Mat& right) const {
  constexpr double kDark = 4.0;  // grey levels
  const double darker = std::min(left_mean, right_mean), brighter = std::max(left_mean, right_mean);
  if (!options_.enabled || darker < kDark || brighter <= (1.0 + options_.tolerance) * darker) return;
  if (left_mean < right_mean)
    left = withLevelsOf(right, left);
  else
    right = withLevelsOf(left, right);
}

}  // namespace sdvo
