#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <cstdint>
#include <cstring>

namespace sdvo {

inline Lanes eightPixels(const std::uint8_t* pixels) {
  const uint16x8_t words = vmovl_u8(vld1_u8(pixels));
  const float32x4_t halves[] = {vcvtq_f32_u32(vmovl_u16(vget_low_u16(words))),
                                vcvtq_f32_u32(vmovl_u16(vget_high_u16(words)))};
  Lanes lanes;
  std::memcpy(&lanes, halves, sizeof lanes);
  return lanes;
}

inline HalfLanes fourPixels(const std::uint8_t* pixels) {
  std::uint32_t four;
  std::memcpy(&four, pixels, sizeof four);
  const uint8x8_t bytes = vreinterpret_u8_u32(vdup_n_u32(four));
  const float32x4_t values = vcvtq_f32_u32(vmovl_u16(vget_low_u16(vmovl_u8(bytes))));
  HalfLanes lanes;
  std::memcpy(&lanes, &values, sizeof lanes);
  return lanes;
}

}  // namespace sdvo
#endif
