#include "image_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "../common/kernel.hpp"

namespace sdvo {
namespace {

constexpr std::int16_t kLargest = 8 * 255;       // response to the mask
constexpr std::int16_t kClipped = kLargest + 1;  // in its place where the pixel is black or white

/// Absolute responses of a row's pixels but its two ends to the mask 1 -2 1, -2 4 -2, 1 -2 1.
struct RespondToMask {
  static SDVO_IN_KERNEL void run(const cv::Mat* image, int y, std::int16_t* responses) {
    const std::uint8_t *above = image->ptr(y - 1), *here = image->ptr(y), *below = image->ptr(y + 1);
    const int columns = image->cols;
    for (int x = 1; x + 1 < columns; ++x) {
      const int left = above[x - 1] - 2 * here[x - 1] + below[x - 1], middle = above[x] - 2 * here[x] + below[x];
      const int right = above[x + 1] - 2 * here[x + 1] + below[x + 1];
      const bool clipped = here[x] == 0 || here[x] == 255;
      responses[x - 1] = clipped ? kClipped : static_cast<std::int16_t>(std::abs(left - 2 * middle + right));
    }
  }
};

}  // namespace

double noiseOf(const cv::Mat& image) {
  CV_Assert(image.type() == CV_8UC1);
  constexpr int kRowStep = 13;  // rows enough; has no factor in common with the blocks of compressed images
  std::array<int, kClipped + 1> counts{};
  std::vector<std::int16_t> responses(static_cast<std::size_t>(std::max(image.cols - 2, 0)));
  for (int y = 1; y + 1 < image.rows; y += kRowStep) {
    runKernel<RespondToMask>(&image, y, responses.data());
    for (const std::int16_t response : responses) ++counts[static_cast<std::size_t>(response)];
  }
  int total = 0;
  for (int response = 0; response <= kLargest; ++response) total += counts[static_cast<std::size_t>(response)];

  // The median within its whole number: absolute responses of r are those from r - 0.5 to r + 0.5.
  double median = 0.0, below = 0.0;
  for (int response = 0; response <= kLargest; ++response) {
    const double count = counts[static_cast<std::size_t>(response)], missing = 0.5 * total - below;
    if (count > 0.0 && count >= missing) {
      median = response == 0 ? 0.5 * missing / count : response - 0.5 + missing / count;
      break;
    }
    below += count;
  }
  constexpr double kMaskNorm = 6.0;            // root of the sum of the mask's squares
  constexpr double kMedianOfNormal = 0.67449;  // of absolute values, in standard deviations
  const double rounding = std::sqrt(1.0 / 12.0);
  return std::max(median / (kMaskNorm * kMedianOfNormal), rounding);
}

}  // namespace sdvo
