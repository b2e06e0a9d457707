#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <cstdint>

#include "freak_octet.hpp"

namespace sdvo {

/// IntegralImage::boxMean with the same operations in the same order, four boxes at once.
class FourBoxes {
 public:
  explicit FourBoxes(const cv::Mat& sums)
      : sums_(sums.ptr<std::int32_t>()),
        step_(static_cast<std::ptrdiff_t>(sums.step1())),
        last_column_(vdupq_n_s32(sums.cols - 2)),
        last_row_(vdupq_n_s32(sums.rows - 2)) {}

  float32x4_t means(float32x4_t u, float32x4_t v, float32x4_t half) const {
    const Edge left = edge(vsubq_f32(u, half), last_column_), right = edge(vaddq_f32(u, half), last_column_);
    const Edge top = edge(vsubq_f32(v, half), last_row_), bottom = edge(vaddq_f32(v, half), last_row_);
    const Places above(top, left, right, static_cast<std::int32_t>(step_));
    const Places below(bottom, left, right, static_cast<std::int32_t>(step_));
    // A register has what one box needs of two rows: two neighbours at the left edge, then two at the right one.
    int32x4_t inside[4], at_top[4], at_bottom[4];
    for (int k = 0; k < 4; ++k) {
      const int32x4_t first = above.read(sums_, k), last = below.read(sums_, k);
      inside[k] = vsubq_s32(last, first);
      at_top[k] = vsubq_s32(above.read(sums_ + step_, k), first);
      at_bottom[k] = vsubq_s32(below.read(sums_ + step_, k), last);
    }
    const float32x4_t down_to_bottom =
        vaddq_f32(between(inside, left, right), vmulq_f32(bottom.share, between(at_bottom, left, right)));
    const float32x4_t sum = vsubq_f32(down_to_bottom, vmulq_f32(top.share, between(at_top, left, right)));
    const float32x4_t area = vmulq_f32(width(left, right), width(top, bottom));
    const float32x4_t rounding = vdupq_n_f32(IntegralImage::kRounding);
    return vsubq_f32(vaddq_f32(vdivq_f32(sum, area), rounding), rounding);
  }

 private:
  struct Edge {
    int32x4_t index;
    float32x4_t share;
  };

  static Edge edge(float32x4_t position, int32x4_t last) {
    const float32x4_t shifted = vaddq_f32(position, vdupq_n_f32(0.5f));
    const int32x4_t index = vmaxq_s32(vminq_s32(vcvtq_s32_f32(shifted), last), vdupq_n_s32(0));
    return {index, vsubq_f32(shifted, vcvtq_f32_s32(index))};
  }

  static float32x4_t width(const Edge& first, const Edge& last) {
    return vaddq_f32(vcvtq_f32_s32(vsubq_s32(last.index, first.index)), vsubq_f32(last.share, first.share));
  }

  /// Where the left and the right edge of four boxes meet a row.
  class Places {
   public:
    Places(const Edge& row, const Edge& left, const Edge& right, std::int32_t step) {
      const int32x4_t begin = vmulq_n_s32(row.index, step);
      vst1q_s32(left_, vaddq_s32(begin, left.index));
      vst1q_s32(right_, vaddq_s32(begin, right.index));
    }

    int32x4_t read(const std::int32_t* sums, int k) const {
      return vcombine_s32(vld1_s32(sums + left_[k]), vld1_s32(sums + right_[k]));
    }

   private:
    std::int32_t left_[4], right_[4];
  };

  /// IntegralImage::sumBetween of four boxes: rows become columns first.
  static float32x4_t between(const int32x4_t (&rows)[4], const Edge& left, const Edge& right) {
    const int64x2_t edges[] = {vreinterpretq_s64_s32(vtrn1q_s32(rows[0], rows[1])),
                               vreinterpretq_s64_s32(vtrn1q_s32(rows[2], rows[3]))};
    const int64x2_t behind[] = {vreinterpretq_s64_s32(vtrn2q_s32(rows[0], rows[1])),
                                vreinterpretq_s64_s32(vtrn2q_s32(rows[2], rows[3]))};
    const int32x4_t at_left = vreinterpretq_s32_s64(vtrn1q_s64(edges[0], edges[1]));
    const int32x4_t at_right = vreinterpretq_s32_s64(vtrn2q_s64(edges[0], edges[1]));
    const int32x4_t behind_left = vreinterpretq_s32_s64(vtrn1q_s64(behind[0], behind[1]));
    const int32x4_t behind_right = vreinterpretq_s32_s64(vtrn2q_s64(behind[0], behind[1]));
    const float32x4_t whole = vcvtq_f32_s32(vsubq_s32(at_right, at_left));
    const float32x4_t of_right = vcvtq_f32_s32(vsubq_s32(behind_right, at_right));
    const float32x4_t of_left = vcvtq_f32_s32(vsubq_s32(behind_left, at_left));
    return vsubq_f32(vaddq_f32(whole, vmulq_f32(right.share, of_right)), vmulq_f32(left.share, of_left));
  }

  const std::int32_t* sums_;
  std::ptrdiff_t step_;
  int32x4_t last_column_, last_row_;
};

inline void measureWithNeon(const cv::Mat& sums, const FreakKeypoint* keypoints, OctetMeans& means) {
  const FourBoxes boxes(sums);
  for (int first = 0; first < kOctet; first += 4) {
    float us[4], vs[4], scales[4], cosines[4], sines[4];
    for (int k = 0; k < 4; ++k) {
      us[k] = keypoints[first + k].u, vs[k] = keypoints[first + k].v;
      const FreakPose pose(keypoints[first + k]);
      scales[k] = pose.scale, cosines[k] = pose.cosine, sines[k] = pose.sine;
    }
    const float32x4_t u = vld1q_f32(us), v = vld1q_f32(vs), scale = vld1q_f32(scales);
    const float32x4_t cosine = vld1q_f32(cosines), sine = vld1q_f32(sines);
    const float32x4_t smallest = vdupq_n_f32(FreakPose::kSmallestHalfSide);
    for (std::size_t i = 0; i < Freak::kFields; ++i) {
      const Freak::Field& field = Freak::pattern()[i];
      const float32x4_t x = vsubq_f32(vaddq_f32(u, vmulq_n_f32(cosine, field.x)), vmulq_n_f32(sine, field.y));
      const float32x4_t y = vaddq_f32(vaddq_f32(v, vmulq_n_f32(sine, field.x)), vmulq_n_f32(cosine, field.y));
      const float32x4_t half = vmaxq_f32(vmulq_n_f32(scale, field.sigma), smallest);
      vst1q_f32(means[i].data() + first, boxes.means(x, y, half));
    }
  }
}

/// A comparison fills the bits of four rows from its own on; those that follow overwrite what lies above it.
template <int kBit>
inline void insertBits(const OctetMeans& means, const Freak::FieldPair* pairs, uint32x4_t (&bits)[2]) {
  const float *a = means[pairs[kBit].first].data(), *b = means[pairs[kBit].second].data();
  bits[0] = vsliq_n_u32(bits[0], vcgtq_f32(vld1q_f32(a), vld1q_f32(b)), kBit);
  bits[1] = vsliq_n_u32(bits[1], vcgtq_f32(vld1q_f32(a + 4), vld1q_f32(b + 4)), kBit);
  if constexpr (kBit < 7) insertBits<kBit + 1>(means, pairs, bits);
}

inline void compareWithNeon(const OctetMeans& means, std::uint8_t* const* rows) {
  for (int byte = 0; byte < Freak::kBytes; ++byte) {
    uint32x4_t bits[2] = {vdupq_n_u32(0), vdupq_n_u32(0)};
    insertBits<0>(means, &Freak::pairs()[static_cast<std::size_t>(8 * byte)], bits);
    std::uint8_t of_rows[kOctet];
    vst1_u8(of_rows, vmovn_u16(vcombine_u16(vmovn_u32(bits[0]), vmovn_u32(bits[1]))));
    for (int k = 0; k < kOctet; ++k) rows[k][byte] = of_rows[k];
  }
}

}  // namespace sdvo
#endif
