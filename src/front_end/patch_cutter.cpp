#include "patch_cutter.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "../common/registers.hpp"

namespace sdvo {
namespace {

/// The squares tile, so each edge serves two of them. Arrays go on to whole registers.
constexpr int kMostEdges = (PatchOptions::kMostSamples + 1 + 7) / 8 * 8;

/// Positions between two columns or two rows of the integral.
struct PatchEdges {
  std::array<int, kMostEdges> index;
  std::array<float, kMostEdges> share;  ///< of the second one
  std::array<float, kMostEdges> width;  ///< px to the next edge; 0 at the last one

  /// `size`: columns or rows of the integral. Pixel p covers [p - 0.5, p + 0.5], and column p of the integral is its
  /// left edge.
  SDVO_IN_KERNEL PatchEdges(float centre, int side, float spacing, int size) {
    const float middle = centre + 0.5f, last = static_cast<float>(size) - 1.001f;
    for (int k = 0; k < kMostEdges; ++k) {
      const float offset = (static_cast<float>(k) - 0.5f * static_cast<float>(side)) * spacing;
      const float position = std::clamp(middle + offset, 0.f, last);
      index[k] = static_cast<int>(position);
      share[k] = position - static_cast<float>(index[k]);
    }
    width[kMostEdges - 1] = 0.f;
    for (int k = 0; k < kMostEdges - 1; ++k)
      width[k] = static_cast<float>(index[k + 1] - index[k]) + share[k + 1] - share[k];
  }
};

/// The nearest whole numbers from 0 to 255, the even one of two.
SDVO_IN_KERNEL IntRegister nearestByte(Register values) {
  constexpr float kWhole = 1.5f * (1 << 23);  // around it a float's last bit is one
  const IntRegister zero = reinterpret_cast<IntRegister>(kWhole - Register{}), most = zero + 255;
  const IntRegister nearest = reinterpret_cast<IntRegister>(values + kWhole);
  const IntRegister not_below = nearest > zero ? nearest : zero;
  return (not_below < most ? not_below : most) - zero;
}

/// Cuts a patch row by row, a register of columns at once; `kCount` registers hold the edges. Sums begin at the patch's
/// first corner: so they are small enough to be exact in single precision.
template <int kCount>
struct CutPatch {
  static SDVO_IN_KERNEL void run(const cv::Mat* integral, float u, float v, int side, float spacing,
                                 std::uint8_t* samples) {
    const PatchEdges columns(u, side, spacing, integral->cols), rows(v, side, spacing, integral->rows);
    const UnsignedRegister origin =
        UnsignedRegister{} + static_cast<unsigned>(integral->ptr<int>(rows.index[0])[columns.index[0]]);
    Register upper[kCount] = {}, lower[kCount] = {}, above[kCount] = {}, across[kCount + 1] = {};
    std::array<std::uint32_t, PatchOptions::kMostSamples * PatchOptions::kMostSamples + kMostEdges> patch;
    for (int j = 0; j <= side; ++j) {
      const int row = rows.index[j];
      // Where edges are a pixel apart, the previous edge's lower row is this one's upper row.
      const bool known = j > 0 && row == rows.index[j - 1] + 1;
      const float height = j > 0 ? rows.width[j - 1] : 0.f;
      for (int r = 0; r < kCount; ++r) {
        upper[r] = known ? lower[r] : sums(integral->ptr<int>(row), columns, r, origin);
        lower[r] = sums(integral->ptr<int>(row + 1), columns, r, origin);
        across[r] = upper[r] + rows.share[j] * (lower[r] - upper[r]);
      }
      for (int r = 0; r < kCount; ++r) {
        const Register upto = nextOf(across[r], across[r + 1]) - across[r], inside = upto - above[r];
        above[r] = upto;
        if (j == 0) continue;
        Register width;
        load(&columns.width[kRegister * r], width);
        const Register area = width * height;
        store(nearestByte(inside / area) & (area > 0.f), &patch[(j - 1) * side + kRegister * r]);
      }
    }
    std::copy_n(patch.begin(), side * side, samples);
  }

  /// Sums at edges in a row of the integral.
  static SDVO_IN_KERNEL Register sums(const int* row, const PatchEdges& columns, int r, UnsignedRegister origin) {
    const auto* places = reinterpret_cast<const unsigned*>(&columns.index[kRegister * r]);
    const Pairs pairs(readPairs(row, places), readPairs(row, places + 2));
    const Register first = toFloats(pairs.first() - origin), second = toFloats(pairs.second() - origin);
    Register share;
    load(&columns.share[kRegister * r], share);
    return first + share * (second - first);
  }
};

}  // namespace

PatchCutter::PatchCutter(const PatchLayout& layout, const cv::Mat& image) : layout_(layout) {
  CV_Assert(image.type() == CV_8UC1);
  cv::integral(image, integral_, CV_32S);
}

void PatchCutter::cut(float u, float v, float size, std::uint8_t* samples) const {
  const auto cutBy = [&](auto kernel) {
    runKernel<decltype(kernel)>(&integral_, u, v, layout_.side, layout_.spacing(size), samples);
  };
  if (layout_.side < 16)
    cutBy(CutPatch<16 / kRegister>());
  else
    cutBy(CutPatch<kMostEdges / kRegister>());
}

}  // namespace sdvo
