#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <cmath>
#include <cstdint>

namespace sdvo {

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch) {
  const int row = static_cast<int>(std::floor(y));
  const float b = y - static_cast<float>(row);
  for (int j = -radius; j <= radius; ++j, patch += columns) {
    // The four pixels around a position weigh the same all along a row.
    const float start = x - slant * static_cast<float>(j), column = std::floor(start), a = start - column;
    const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
    const std::uint8_t* upper = image.ptr(row + j + margin) + static_cast<int>(column) - radius + margin;
    const std::uint8_t* lower = upper + image.step[0];
    for (int i = 0; i < columns; ++i)
      patch[i] = w00 * upper[i] + w01 * upper[i + 1] + w10 * lower[i] + w11 * lower[i + 1];
  }
}

}  // namespace sdvo
