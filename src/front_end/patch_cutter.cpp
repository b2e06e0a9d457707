#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"

#include <array>
#include <opencv2/imgproc.hpp>

namespace sdvo {
namespace {

/// A position between two columns or two rows of the integral.
struct Edge {
  int index;
  float share;  ///< of the second one
};

/// The squares' edges: they tile, so each edge serves two of them.
using Edges = std::array<Edge, PatchOptions::kMostSamples + 1>;

/// Along one row, at the edges.
using Sums = std::array<float, PatchOptions::kMostSamples + 1>;

/// `size`: columns or rows of the integral. Pixel p covers [p - 0.5, p + 0.5], and column p of the integral is its left
/// edge.
Edges edgesAround(float centre, const PatchLayout& layout, float spacing, int size) {
  Edges edges{};
  for (int k = 0; k <= layout.side; ++k) {
    const float offset = (static_cast<float>(k) - 0.5f * static_cast<float>(layout.side)) * spacing;
    const float position = std::clamp(centre + 0.5f + offset, 0.f, static_cast<float>(size) - 1.001f);
    const int index = static_cast<int>(position);
    edges[k] = {index, position - static_cast<float>(index)};
  }
  return edges;
}

}  // namespace

PatchCutter::PatchCutter(const PatchLayout& layout, const cv::Mat& image) : layout_(layout) {
  CV_Assert(image.type() == CV_8UC1);
  cv::integral(image, integral_, CV_32S);
}

void PatchCutter::cut(float u, float v, float size, std::uint8_t* samples) const {
  const float spacing = layout_.spacing(size);
  const Edges columns = edgesAround(u, layout_, spacing, integral_.cols);
  const Edges rows = edgesAround(v, layout_, spacing, integral_.rows);
  const int origin = integral_.ptr<int>(rows[0].index)[columns[0].index];
  // Sums since the patch's own corner are small enough to be exact in single precision.
  const auto sumsAt = [&](int row, Sums& sums) {
    const int* integral = integral_.ptr<int>(row);
    const auto since = [&](int index) {
      return static_cast<float>(
          static_cast<int>(static_cast<unsigned>(integral[index]) - static_cast<unsigned>(origin)));
    };
    for (int k = 0; k <= layout_.side; ++k) {
      const auto& [index, share] = columns[k];
      sums[k] = since(index) + share * (since(index + 1) - since(index));
    }
  };
  Sums upper{}, lower{}, above{}, upto{};
  for (int j = 0; j <= layout_.side; ++j) {
    // Where edges are a pixel apart, each row of the integral serves two of them.
    if (j > 0 && rows[j].index == rows[j - 1].index + 1)
      upper = lower;
    else
      sumsAt(rows[j].index, upper);
    sumsAt(rows[j].index + 1, lower);
    float left = upper[0] + rows[j].share * (lower[0] - upper[0]);
    for (int i = 0; i < layout_.side; ++i) {
      const float right = upper[i + 1] + rows[j].share * (lower[i + 1] - upper[i + 1]);
      upto[i] = right - left;
      left = right;
    }
    if (j > 0) {
      const float height = rows[j].index - rows[j - 1].index + rows[j].share - rows[j - 1].share;
      for (int i = 0; i < layout_.side; ++i) {
        const float width = columns[i + 1].index - columns[i].index + columns[i + 1].share - columns[i].share;
        const float area = width * height;
        const float mean = area > 0.f ? (upto[i] - above[i]) / area : 0.f;
        *samples++ = cv::saturate_cast<std::uint8_t>(mean);
      }
    }
    above = upto;
  }
}

}  // namespace sdvo
