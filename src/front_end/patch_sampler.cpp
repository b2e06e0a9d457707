#include "stereo_descriptor_vo/front_end/patch_sampler.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace sdvo {

PatchSampler::PatchSampler(const PatchOptions& options, const cv::Mat& image) : options_(options) {
  cv::integral(image, integral_, CV_32S);
}

float PatchSampler::spacing(float size) const {
  return static_cast<float>(std::max(options_.patch_min_spacing, options_.patch_spacing * size));
}

void PatchSampler::sample(float u, float v, float spacing, std::uint8_t* patch) const {
  constexpr int kMost = 17;
  const int side = options_.patch_side;
  struct Edge { int index; float share; };
  std::array<Edge, kMost> columns, rows;
  const auto edges = [&](float centre, int size, std::array<Edge, kMost>& result) {
    for (int k = 0; k <= side; ++k) {
      const float at = std::clamp(centre + 0.5f + (static_cast<float>(k) - 0.5f * side) * spacing, 0.f, size - 1.001f);
      const int index = static_cast<int>(at);
      result[k] = {index, at - index};
    }
  };
  edges(u, integral_.cols, columns);
  edges(v, integral_.rows, rows);
  std::array<float, kMost> above, below;
  const float scale = 1.f / (spacing * spacing);
  for (int j = 0; j <= side; ++j) {
    const int* top = integral_.ptr<int>(rows[j].index);
    const int* next = integral_.ptr<int>(rows[j].index + 1);
    const int origin = top[columns[0].index];
    for (int i = 0; i <= side; ++i) {
      const int c = columns[i].index;
      const float s = columns[i].share, t = rows[j].share;
      const float a = float(top[c] - origin), b = float(top[c + 1] - origin);
      const float e = float(next[c] - origin), f = float(next[c + 1] - origin);
      const float upper = a + s * (b - a), lower = e + s * (f - e);
      below[i] = upper + t * (lower - upper);
    }
    if (j > 0) {
      for (int i = 0; i < side; ++i) {
        const float sum = (below[i + 1] - below[i]) - (above[i + 1] - above[i]);
        *patch++ = static_cast<std::uint8_t>(std::clamp(sum * scale + 0.5f, 0.f, 255.f));
      }
    }
    above = below;
  }
}

}  // namespace sdvo
