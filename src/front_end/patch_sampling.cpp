#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "../common/kernel.hpp"

namespace sdvo {
namespace {

struct SampleRows {
  /// `pixels` is where the middle row of the picture begins, at the pixels that positions refer to.
  static SDVO_IN_KERNEL void run(const std::uint8_t* pixels, std::ptrdiff_t step, float x, float b, float slant,
                                 int radius, int columns, float* __restrict patch) {
    for (int j = -radius; j <= radius; ++j, patch += columns) {
      // The four pixels around a position weigh the same all along a row.
      const float start = x - slant * static_cast<float>(j), column = std::floor(start), a = start - column;
      const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
      const std::uint8_t *upper = pixels + j * step + static_cast<int>(column) - radius, *lower = upper + step;
      for (int i = 0; i < columns; ++i)
        patch[i] = w00 * upper[i] + w01 * upper[i + 1] + w10 * lower[i] + w11 * lower[i + 1];
    }
  }
};

}  // namespace

void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch) {
  const int row = static_cast<int>(std::floor(y));
  runKernel<SampleRows>(image.ptr(row + margin) + margin, static_cast<std::ptrdiff_t>(image.step[0]), x,
                        y - static_cast<float>(row), slant, radius, columns, patch);
}

}  // namespace sdvo
