#include "stereo_descriptor_vo/front_end/block_differences.hpp"

#include <cstdlib>

#include "../common/kernel.hpp"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace sdvo {
namespace {

template <int kRows>
struct BlockDifferences {
#ifdef __SSE2__
  static SDVO_IN_KERNEL __m128i load(const std::uint8_t* pixels) {
    return _mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels));
  }
#endif

  static SDVO_IN_KERNEL void run(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step, int count,
                                 unsigned* differences) {
    constexpr int kLeft = kBlockWidth / 2;
    block -= kRows * step + kLeft, others -= kRows * step + kLeft;
#ifdef __SSE2__
    __m128i rows[2 * kRows + 1];
#pragma GCC unroll 16
    for (int row = 0; row <= 2 * kRows; ++row) rows[row] = load(block + row * step);
    for (int k = 0; k < count; ++k) {
      __m128i sums = _mm_setzero_si128();  // one of either half
#pragma GCC unroll 16
      for (int row = 0; row <= 2 * kRows; ++row)
        sums = _mm_add_epi64(sums, _mm_sad_epu8(rows[row], load(others + row * step - k)));
      differences[k] = static_cast<unsigned>(_mm_cvtsi128_si32(sums) + _mm_extract_epi16(sums, 4));
    }
#else
    for (int k = 0; k < count; ++k) {
      unsigned sum = 0;
      for (int row = 0; row <= 2 * kRows; ++row)
        for (int i = 0; i < kBlockWidth; ++i)
          sum += static_cast<unsigned>(std::abs(block[row * step + i] - others[row * step + i - k]));
      differences[k] = sum;
    }
#endif
  }
};

}  // namespace

template <int kRows>
void blockDifferences(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step, int count,
                      unsigned* differences) {
  runKernel<BlockDifferences<kRows>>(block, others, step, count, differences);
}

template void blockDifferences<4>(const std::uint8_t*, const std::uint8_t*, std::ptrdiff_t, int, unsigned*);
template void blockDifferences<5>(const std::uint8_t*, const std::uint8_t*, std::ptrdiff_t, int, unsigned*);

}  // namespace sdvo
