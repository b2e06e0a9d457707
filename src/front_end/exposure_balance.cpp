#include "exposure_balance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "../common/statistics.hpp"

namespace sdvo {
namespace {

constexpr int kLevels = 256;

/// Parts of the images, row by row.
constexpr int kColumns = 8, kRows = 6;
using ValueOfParts = std::array<double, kColumns * kRows>;

/// Logarithm of the right part's mean grey level by the left one's.
ValueOfParts logRatios(const cv::Mat& left, const cv::Mat& right) {
  cv::Mat means[2];
  cv::resize(left, means[0], {kColumns, kRows}, 0.0, 0.0, cv::INTER_AREA);
  cv::resize(right, means[1], {kColumns, kRows}, 0.0, 0.0, cv::INTER_AREA);
  ValueOfParts ratios;
  const std::uint8_t *of_left = means[0].ptr(), *of_right = means[1].ptr();
  for (std::size_t i = 0; i < ratios.size(); ++i) ratios[i] = std::log((of_right[i] + 1.0) / (of_left[i] + 1.0));
  return ratios;
}

/// For each grey level, how many pixels have at most that level. Every second row of the parts that count.
std::array<int, kLevels> cumulativeHistogram(const cv::Mat& image, const std::array<bool, kColumns * kRows>& counting) {
  std::array<int, kLevels> counts{};
  for (int y = 0; y < image.rows; y += 2) {
    const std::uint8_t* row = image.ptr(y);
    for (int column = 0; column < kColumns; ++column) {
      if (!counting[static_cast<std::size_t>(y * kRows / image.rows * kColumns + column)]) continue;
      const int end = (column + 1) * image.cols / kColumns;
      for (int x = column * image.cols / kColumns; x < end; ++x) ++counts[row[x]];
    }
  }
  for (int level = 1; level < kLevels; ++level) counts[level] += counts[level - 1];
  return counts;
}

/// `image` with the grey levels of `model`.
cv::Mat withLevelsOf(const cv::Mat& model, const cv::Mat& image, const std::array<bool, kColumns * kRows>& counting) {
  const auto of_image = cumulativeHistogram(image, counting), of_model = cumulativeHistogram(model, counting);
  cv::Mat table(1, kLevels, CV_8U), result;
  int found = 0;
  for (int level = 0; level < kLevels; ++level) {
    // Pixels are ranked by grey level. A level is mapped by the rank of its middle pixel: its first or last one would
    // bias levels of many pixels.
    const int darker = level > 0 ? of_image[level - 1] : 0;
    const int rank = darker + (of_image[level] - darker) / 2;
    while (found < kLevels - 1 && of_model[found] <= rank) ++found;
    table.at<std::uint8_t>(level) = static_cast<std::uint8_t>(found);
  }
  cv::LUT(image, table, result);
  return result;
}

}  // namespace

void balanceExposures(double left_mean, double right_mean, cv::Mat& left, cv::Mat& right) {
  constexpr double kDark = 4.0;        // grey levels
  constexpr double kTolerance = 0.15;  // ratio of the mean grey levels beyond 1
  const double darker = std::min(left_mean, right_mean), brighter = std::max(left_mean, right_mean);
  if (darker < kDark || brighter <= (1.0 + kTolerance) * darker) return;
  // A part that is covered on one side has another ratio; it is left out of the histograms.
  constexpr double kCovered = 2.0;  // factor between its ratio and that of most parts (chosen)
  const ValueOfParts ratios = logRatios(left, right);
  const double usual = quantile({ratios.begin(), ratios.end()}, 0.5);
  if (std::abs(usual) <= std::log1p(kTolerance)) return;
  std::array<bool, kColumns * kRows> counting;
  for (std::size_t i = 0; i < ratios.size(); ++i) counting[i] = std::abs(ratios[i] - usual) < std::log(kCovered);
  if (usual > 0.0)
    left = withLevelsOf(right, left, counting);
  else
    right = withLevelsOf(left, right, counting);
}

}  // namespace sdvo
