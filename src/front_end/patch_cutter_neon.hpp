#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

#include "patch_edges.hpp"

namespace sdvo {

/// Sums in a row at the edges, four of them at once, with the operations of the plain form.
class FourSums {
 public:
  FourSums(const PatchEdges& columns, int registers, int origin)
      : columns_(columns),
        neighbours_(areNeighbours(columns.index.data(), 4 * registers)),
        origin_(vdupq_n_s32(origin)) {}

  float32x4_t inRow(const int* row, int r) const {
    const int* index = &columns_.index[4 * r];
    if (neighbours_) return between(vld1q_s32(row + index[0]), vld1q_s32(row + index[0] + 1), r);
    const int32x4_t low = vcombine_s32(vld1_s32(row + index[0]), vld1_s32(row + index[1]));
    const int32x4_t high = vcombine_s32(vld1_s32(row + index[2]), vld1_s32(row + index[3]));
    return between(vuzp1q_s32(low, high), vuzp2q_s32(low, high), r);
  }

 private:
  static bool areNeighbours(const int* index, int count) {
    bool all = true;
    for (int k = 1; k < count; ++k) all &= index[k] == index[0] + k;
    return all;
  }
  float32x4_t sinceOrigin(int32x4_t sums) const { return vcvtq_f32_s32(vsubq_s32(sums, origin_)); }
  float32x4_t between(int32x4_t sums, int32x4_t next_sums, int r) const {
    const float32x4_t first = sinceOrigin(sums), second = sinceOrigin(next_sums);
    return vaddq_f32(first, vmulq_f32(vld1q_f32(&columns_.share[4 * r]), vsubq_f32(second, first)));
  }

  const PatchEdges& columns_;
  bool neighbours_;
  int32x4_t origin_;
};

/// Four means as bytes, rounded to the nearest whole number, the even one of two.
inline void storeRounded(float32x4_t means, std::uint8_t* bytes) {
  const uint16x4_t words = vqmovun_s32(vcvtnq_s32_f32(means));
  vst1_lane_u32(reinterpret_cast<std::uint32_t*>(bytes), vreinterpret_u32_u8(vqmovn_u16(vcombine_u16(words, words))),
                0);
}

/// The same as the plain form row by row, four columns at once. `kRegisters` hold the edges.
template <int kRegisters>
void cutWithRegisters(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
                      std::uint8_t* samples) {
  const FourSums sums(columns, kRegisters, integral.ptr<int>(rows.index[0])[columns.index[0]]);
  float32x4_t upper[kRegisters], lower[kRegisters], above[kRegisters], across[kRegisters + 1];
  for (int r = 0; r < kRegisters; ++r) above[r] = lower[r] = vdupq_n_f32(0.f);
  across[kRegisters] = vdupq_n_f32(0.f);
  std::array<std::uint8_t, PatchOptions::kMostSamples * PatchOptions::kMostSamples + 4 * kRegisters> patch;
  for (int j = 0; j <= side; ++j) {
    const int row = rows.index[j];
    // Where edges are a pixel apart, each row of the integral serves two of them.
    const bool known = j > 0 && row == rows.index[j - 1] + 1;
    const float height = j > 0 ? rows.width[j - 1] : 0.f;
    for (int r = 0; r < kRegisters; ++r) {
      upper[r] = known ? lower[r] : sums.inRow(integral.ptr<int>(row), r);
      lower[r] = sums.inRow(integral.ptr<int>(row + 1), r);
      across[r] = vaddq_f32(upper[r], vmulq_n_f32(vsubq_f32(lower[r], upper[r]), rows.share[j]));
    }
    for (int r = 0; r < kRegisters; ++r) {
      const float32x4_t upto = vsubq_f32(vextq_f32(across[r], across[r + 1], 1), across[r]);
      const float32x4_t inside = vsubq_f32(upto, above[r]);
      above[r] = upto;
      if (j == 0) continue;
      const float32x4_t area = vmulq_n_f32(vld1q_f32(&columns.width[4 * r]), height);
      const uint32x4_t mean = vandq_u32(vreinterpretq_u32_f32(vdivq_f32(inside, area)), vcgtzq_f32(area));
      storeRounded(vreinterpretq_f32_u32(mean), &patch[(j - 1) * side + 4 * r]);
    }
  }
  std::copy_n(patch.begin(), side * side, samples);
}

inline void cutWithNeon(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
                        std::uint8_t* samples) {
  const auto cut = side < 8    ? cutWithRegisters<2>
                   : side < 12 ? cutWithRegisters<3>
                   : side < 16 ? cutWithRegisters<4>
                               : cutWithRegisters<kMostEdges / 4>;
  cut(integral, columns, rows, side, samples);
}

}  // namespace sdvo
#endif
