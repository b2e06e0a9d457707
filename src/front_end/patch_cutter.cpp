#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"

#include <array>
#include <opencv2/imgproc.hpp>

#include "../common/kernel.hpp"

namespace sdvo {
namespace {

/// The squares tile, so each edge serves two of them. Arrays go on to whole registers.
constexpr int kMostEdges = (PatchOptions::kMostSamples + 1 + 7) / 8 * 8;
using Floats = std::array<float, kMostEdges>;

/// Positions between two columns or two rows of the integral.
struct Edges {
  std::array<int, kMostEdges> index{};
  Floats share{};  ///< of the second one

  /// From the edge before.
  float distance(int k) const { return static_cast<float>(index[k] - index[k - 1]) + share[k] - share[k - 1]; }
};

/// `size`: columns or rows of the integral. Pixel p covers [p - 0.5, p + 0.5], and column p of the integral is its left
/// edge.
Edges edgesAround(float centre, const PatchLayout& layout, float spacing, int size) {
  Edges edges;
  for (int k = 0; k <= layout.side; ++k) {
    const float offset = (static_cast<float>(k) - 0.5f * static_cast<float>(layout.side)) * spacing;
    const float position = std::clamp(centre + 0.5f + offset, 0.f, static_cast<float>(size) - 1.001f);
    edges.index[k] = static_cast<int>(position);
    edges.share[k] = position - static_cast<float>(edges.index[k]);
  }
  return edges;
}

/// Sums along one row of the integral, at the edges. Since the patch's own corner they are small enough to be exact in
/// single precision.
struct SumsAtEdges {
  static SDVO_IN_KERNEL void run(const int* integral, int origin, const Edges* edges, int count, float* sums) {
    for (int k = 0; k < count; ++k) {
      const int index = edges->index[k];
      const float first = since(origin, integral[index]), second = since(origin, integral[index + 1]);
      sums[k] = first + edges->share[k] * (second - first);
    }
  }
  static SDVO_IN_KERNEL float since(int origin, int sum) {
    return static_cast<float>(static_cast<int>(static_cast<unsigned>(sum) - static_cast<unsigned>(origin)));
  }
};

/// What lies above an edge between two rows of the integral, for each square; and the means down to there.
struct MeansOfRow {
  static SDVO_IN_KERNEL void run(const float* upper, const float* lower, float share, const float* widths, float height,
                                 int count, float* above, float* means) {
    for (int i = 0; i < count; ++i) {
      const float left = upper[i] + share * (lower[i] - upper[i]);
      const float right = upper[i + 1] + share * (lower[i + 1] - upper[i + 1]);
      const float upto = right - left, area = widths[i] * height;
      means[i] = area > 0.f ? (upto - above[i]) / area : 0.f;
      above[i] = upto;
    }
  }
};

/// To the nearest whole number, the even one of two, as cv::saturate_cast has it: means lie within 0…255 but for their
/// own rounding.
struct Round {
  static SDVO_IN_KERNEL void run(const float* means, int count, std::uint8_t* samples) {
    constexpr float kUnitsOnly = 12582912.f;  // 1.5 * 2^23: what is added to it loses its fraction
    for (int i = 0; i < count; ++i)
      samples[i] = static_cast<std::uint8_t>(static_cast<int>((means[i] + kUnitsOnly) - kUnitsOnly));
  }
};

}  // namespace

PatchCutter::PatchCutter(const PatchLayout& layout, const cv::Mat& image) : layout_(layout) {
  CV_Assert(image.type() == CV_8UC1);
  cv::integral(image, integral_, CV_32S);
}

void PatchCutter::cut(float u, float v, float size, std::uint8_t* samples) const {
  const float spacing = layout_.spacing(size);
  const Edges columns = edgesAround(u, layout_, spacing, integral_.cols);
  const Edges rows = edgesAround(v, layout_, spacing, integral_.rows);
  const int origin = integral_.ptr<int>(rows.index[0])[columns.index[0]];
  const int side = layout_.side, edges = (side + 1 + 7) / 8 * 8;
  const auto sumsAt = [&](int row, Floats& sums) {
    runKernel<SumsAtEdges>(integral_.ptr<int>(row), origin, &columns, edges, sums.data());
  };
  Floats upper{}, lower{}, widths{}, above{}, means{};
  for (int i = 0; i < side; ++i) widths[i] = columns.distance(i + 1);
  for (int j = 0; j <= side; ++j) {
    // Where edges are a pixel apart, each row of the integral serves two of them.
    if (j > 0 && rows.index[j] == rows.index[j - 1] + 1)
      upper = lower;
    else
      sumsAt(rows.index[j], upper);
    sumsAt(rows.index[j] + 1, lower);
    const float height = j > 0 ? rows.distance(j) : 0.f;
    runKernel<MeansOfRow>(upper.data(), lower.data(), rows.share[j], widths.data(), height, side, above.data(),
                          means.data());
    if (j == 0) continue;
    runKernel<Round>(means.data(), side, samples);
    samples += side;
  }
}

}  // namespace sdvo
