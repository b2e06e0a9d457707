#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "../common/registers.hpp"

namespace sdvo {
namespace {

/// The squares tile, so each edge serves two of them. Arrays go on to whole registers.
constexpr int kMostEdges = (PatchOptions::kMostSamples + 1 + 7) / 8 * 8;
using PerEdge = std::array<float, kMostEdges>;

/// Positions between two columns or two rows of the integral.
struct PatchEdges {
  std::array<int, kMostEdges> index;
  PerEdge share;  ///< of the second one
  PerEdge width;  ///< px to the next edge; 0 at the last one
};

/// `size`: columns or rows of the integral. Pixel p covers [p - 0.5, p + 0.5], and column p of the integral is its left
/// edge.
struct FindEdges {
  static SDVO_IN_KERNEL void run(float centre, int side, float spacing, int size, PatchEdges* edges) {
    const float middle = centre + 0.5f, last = static_cast<float>(size) - 1.001f;
    for (int k = 0; k < kMostEdges; ++k) {
      const float offset = (static_cast<float>(k) - 0.5f * static_cast<float>(side)) * spacing;
      const float position = std::clamp(middle + offset, 0.f, last);
      edges->index[k] = static_cast<int>(position);
      edges->share[k] = position - static_cast<float>(edges->index[k]);
    }
    edges->width[kMostEdges - 1] = 0.f;
    for (int k = 0; k < kMostEdges - 1; ++k)
      edges->width[k] =
          static_cast<float>(edges->index[k + 1] - edges->index[k]) + edges->share[k + 1] - edges->share[k];
  }
};

PatchEdges edgesAround(float centre, int side, float spacing, int size) {
  PatchEdges edges;
  runKernel<FindEdges>(centre, side, spacing, size, &edges);
  return edges;
}

/// Sums of the pixels between the patch's first corner and real-valued positions. From there they are small enough to
/// be exact in single precision.
class Sums {
 public:
  Sums(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows)
      : integral_(integral), columns_(columns), origin_(integral.ptr<int>(rows.index[0])[columns.index[0]]) {}

  float at(int row, float share, int edge) const {
    const float upper = inRow(row, edge), lower = inRow(row + 1, edge);
    return upper + share * (lower - upper);
  }

 private:
  float inRow(int row, int edge) const {
    const int* sums = integral_.ptr<int>(row) + columns_.index[edge];
    const float first = sinceOrigin(sums[0]), second = sinceOrigin(sums[1]);
    return first + columns_.share[edge] * (second - first);
  }
  float sinceOrigin(int sum) const {
    return static_cast<float>(static_cast<int>(static_cast<unsigned>(sum) - static_cast<unsigned>(origin_)));
  }

  const cv::Mat& integral_;
  const PatchEdges& columns_;
  int origin_;
};

void cutPlain(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
              std::uint8_t* samples) {
  const Sums sums(integral, columns, rows);
  PerEdge above{};  // for each column of squares, the sum of all pixels above the present row of them
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i < side; ++i) {
      const float upto = sums.at(rows.index[j], rows.share[j], i + 1) - sums.at(rows.index[j], rows.share[j], i);
      const float inside = upto - above[i];
      above[i] = upto;
      if (j == 0) continue;
      const float area = columns.width[i] * rows.width[j - 1];
      *samples++ = cv::saturate_cast<std::uint8_t>(area > 0.f ? inside / area : 0.f);
    }
}

/// Sums in a row at the edges, a register of them at once, with the operations of the plain form.
class RowSums {
 public:
  SDVO_VECTORS RowSums(const PatchEdges& columns, int origin)
      : columns_(columns), origin_(UnsignedRegister{} + static_cast<unsigned>(origin)) {}

  SDVO_VECTORS Register at(const int* row, int r) const {
    const auto* places = reinterpret_cast<const unsigned*>(&columns_.index[kRegister * r]);
    const Pairs pairs(readPairs(row, places), readPairs(row, places + 2));
    const Register first = toFloats(pairs.first() - origin_), second = toFloats(pairs.second() - origin_);
    Register share;
    load(&columns_.share[kRegister * r], share);
    return first + share * (second - first);
  }

 private:
  const PatchEdges& columns_;
  UnsignedRegister origin_;
};

/// The nearest whole numbers from 0 to 255, the even one of two.
SDVO_VECTORS inline IntRegister nearestByte(Register values) {
  constexpr float kWhole = 1.5f * (1 << 23);  // around it a float's last bit is one
  const IntRegister zero = reinterpret_cast<IntRegister>(kWhole - Register{}), most = zero + 255;
  const IntRegister nearest = reinterpret_cast<IntRegister>(values + kWhole);
  const IntRegister not_below = nearest > zero ? nearest : zero;
  return (not_below < most ? not_below : most) - zero;
}

/// The same row by row, a register of columns at once. `kCount` of them hold the edges.
template <int kCount>
SDVO_VECTORS void cutWithVectors(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
                                 std::uint8_t* samples) {
  const RowSums sums(columns, integral.ptr<int>(rows.index[0])[columns.index[0]]);
  Register upper[kCount] = {}, lower[kCount] = {}, above[kCount] = {}, across[kCount + 1] = {};
  std::array<std::uint32_t, PatchOptions::kMostSamples * PatchOptions::kMostSamples + kRegister * kCount> patch;
  for (int j = 0; j <= side; ++j) {
    const int row = rows.index[j];
    // Where edges are a pixel apart, the previous edge's lower row is this one's upper row.
    const bool known = j > 0 && row == rows.index[j - 1] + 1;
    const float height = j > 0 ? rows.width[j - 1] : 0.f;
    for (int r = 0; r < kCount; ++r) {
      upper[r] = known ? lower[r] : sums.at(integral.ptr<int>(row), r);
      lower[r] = sums.at(integral.ptr<int>(row + 1), r);
      across[r] = upper[r] + rows.share[j] * (lower[r] - upper[r]);
    }
    for (int r = 0; r < kCount; ++r) {
      const Register upto = nextOf(across[r], across[r + 1]) - across[r], inside = upto - above[r];
      above[r] = upto;
      if (j == 0) continue;
      Register width;
      load(&columns.width[kRegister * r], width);
      const Register area = width * height;
      const IntRegister grey = nearestByte(inside / area) & (area > 0.f);
      store(grey, &patch[(j - 1) * side + kRegister * r]);
    }
  }
  std::copy_n(patch.begin(), side * side, samples);
}

}  // namespace

PatchCutter::PatchCutter(const PatchLayout& layout, const cv::Mat& image) : layout_(layout) {
  CV_Assert(image.type() == CV_8UC1);
  cv::integral(image, integral_, CV_32S);
}

void PatchCutter::cut(float u, float v, float size, std::uint8_t* samples) const {
  const float spacing = layout_.spacing(size);
  const PatchEdges columns = edgesAround(u, layout_.side, spacing, integral_.cols);
  const PatchEdges rows = edgesAround(v, layout_.side, spacing, integral_.rows);
  if (usesVectorKernels()) {
    const auto cut = layout_.side < 8    ? cutWithVectors<8 / kRegister>
                     : layout_.side < 16 ? cutWithVectors<16 / kRegister>
                                         : cutWithVectors<kMostEdges / kRegister>;
    return cut(integral_, columns, rows, layout_.side, samples);
  }
  cutPlain(integral_, columns, rows, layout_.side, samples);
}

}  // namespace sdvo
