#pragma once

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_NEON
#include <arm_neon.h>

#include <cstddef>
#include <cstdint>

#include "block_differences.hpp"

namespace sdvo {

/// The block's rows stay in registers; pairs of differences are added up in 16 bits, which hold them: 11 rows of two
/// bytes.
template <int kRows>
void blockDifferencesWithNeon(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step, int count,
                              unsigned* differences) {
  constexpr int kLeft = kBlockWidth / 2;
  block -= kRows * step + kLeft, others -= kRows * step + kLeft;
  uint8x16_t rows[2 * kRows + 1];
#pragma GCC unroll 16
  for (int row = 0; row <= 2 * kRows; ++row) rows[row] = vld1q_u8(block + row * step);
  for (int k = 0; k < count; ++k) {
    uint16x8_t sums = vdupq_n_u16(0);
#pragma GCC unroll 16
    for (int row = 0; row <= 2 * kRows; ++row)
      sums = vpadalq_u8(sums, vabdq_u8(rows[row], vld1q_u8(others + row * step - k)));
    differences[k] = vaddvq_u16(sums);
  }
}

}  // namespace sdvo
#endif
