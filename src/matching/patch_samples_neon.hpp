#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <cstdint>
#include <cstring>

#include "patch_samples.hpp"

namespace sdvo {

/// Two bytes next to each other at each of four places.
inline uint32x4_t fourPairs(const std::uint8_t* samples, const std::int32_t (&index)[4]) {
  std::uint16_t pairs[4];
  for (int k = 0; k < 4; ++k) std::memcpy(&pairs[k], samples + index[k], sizeof pairs[k]);
  return vmovl_u16(vld1_u16(pairs));
}

/// The two bytes interpolated.
inline float32x4_t between(uint32x4_t pairs, float32x4_t share) {
  const int32x4_t first = vreinterpretq_s32_u32(vandq_u32(pairs, vdupq_n_u32(255)));
  const int32x4_t second = vreinterpretq_s32_u32(vshrq_n_u32(pairs, 8));
  return vaddq_f32(vcvtq_f32_s32(first), vmulq_f32(share, vcvtq_f32_s32(vsubq_s32(second, first))));
}

inline float32x4_t position(float middle, float by_x, float by_y, float32x4_t x, float32x4_t y) {
  return vaddq_f32(vaddq_f32(vdupq_n_f32(middle), vmulq_n_f32(x, by_x)), vmulq_n_f32(y, by_y));
}

/// The same operations as the plain form in the same order, four samples at once.
inline void sampleWithNeon(const std::uint8_t* patch, int side, const PatchPlacement& at, const float* dx,
                           const float* dy, const float* mask, int count, float* values) {
  const int32x4_t zero = vdupq_n_s32(0), last = vdupq_n_s32(side - 2);
  for (int k = 0; k < count; k += 4) {
    const float32x4_t over = vld1q_f32(dx + k), down = vld1q_f32(dy + k);
    const float32x4_t x = position(at.x, at.x_by_x, at.x_by_y, over, down);
    const float32x4_t y = position(at.y, at.y_by_x, at.y_by_y, over, down);
    const int32x4_t column = vmaxq_s32(vminq_s32(vcvtq_s32_f32(x), last), zero);
    const int32x4_t row = vmaxq_s32(vminq_s32(vcvtq_s32_f32(y), last), zero);
    std::int32_t index[4];
    vst1q_s32(index, vmlaq_n_s32(column, row, side));
    const float32x4_t a = vsubq_f32(x, vcvtq_f32_s32(column)), b = vsubq_f32(y, vcvtq_f32_s32(row));
    const float32x4_t upper = between(fourPairs(patch, index), a), lower = between(fourPairs(patch + side, index), a);
    const float32x4_t value = vaddq_f32(upper, vmulq_f32(b, vsubq_f32(lower, upper)));
    vst1q_f32(values + k, vmulq_f32(value, vld1q_f32(mask + k)));
  }
}

}  // namespace sdvo
#endif
