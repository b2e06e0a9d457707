#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

namespace sdvo {

inline void distancesWithNeon(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates,
                              std::size_t count, float* distances) {
  constexpr int kBytes = 16;
  const int whole = others.cols / kBytes * kBytes;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* other = others.ptr(candidates[k]);
    uint16x8_t sums = vdupq_n_u16(0);
    for (int byte = 0; byte < whole; byte += kBytes)
      sums = vpadalq_u8(sums, vcntq_u8(veorq_u8(vld1q_u8(descriptor + byte), vld1q_u8(other + byte))));
    int distance = vaddvq_u16(sums);
    for (int byte = whole; byte < others.cols; ++byte)
      distance += __builtin_popcount(static_cast<unsigned>(descriptor[byte] ^ other[byte]));
    distances[k] = static_cast<float>(distance);
  }
}

}  // namespace sdvo
#endif
