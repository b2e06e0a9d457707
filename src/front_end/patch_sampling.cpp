#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

#include <cmath>

// Most of the time of the stereo match goes into this loop. Eight pixels at once need instructions that not every
// processor has; the loader picks the right version, and both give the same bits (no fused multiply-add).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SDVO_VECTORISED __attribute__((target_clones("avx2", "default"), optimize("O3")))
#else
#define SDVO_VECTORISED
#endif

namespace sdvo {

SDVO_VECTORISED void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius,
                                 int columns, float* patch) {
  const int row = static_cast<int>(std::floor(y));
  const float b = y - static_cast<float>(row);
  const std::size_t step = image.step1();
  const float* first = image.ptr<float>(row - radius + margin);
  for (int j = -radius; j <= radius; ++j, first += step) {
    const float start = x - slant * static_cast<float>(j);
    const int column = static_cast<int>(std::floor(start));
    const float a = start - static_cast<float>(column);
    const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
    const float* upper = first + column - radius + margin;
    const float* lower = upper + step;
    float* __restrict values = patch + (j + radius) * columns;
    for (int i = 0; i < columns; ++i)
      values[i] = w00 * upper[i] + w01 * upper[i + 1] + w10 * lower[i] + w11 * lower[i + 1];
  }
}

}  // namespace sdvo
