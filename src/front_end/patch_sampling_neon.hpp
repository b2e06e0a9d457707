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

}  // namespace sdvo
#endif
