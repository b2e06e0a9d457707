#include "block_differences.hpp"

#include <algorithm>
#include <cstdlib>

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(SDVO_HAVE_NEON)
#include <arm_neon.h>
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

#ifdef SDVO_HAVE_AVX2
constexpr int kAtOnce = 16;  // blocks

/// Pixels for eight blocks, and in the other half for the eight further right.
SDVO_AVX2 inline __m256i loadTwice(const std::uint8_t* pixels) {
  const auto* first = reinterpret_cast<const __m128i*>(pixels);
  const auto* second = reinterpret_cast<const __m128i*>(pixels + 8);
  return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(first)), _mm_loadu_si128(second), 1);
}

/// At least kAtOnce blocks: each instruction compares four columns of one with those of eight others. The last ones may
/// be done twice.
template <int kRows>
SDVO_AVX2 void blockDifferencesWithAvx2(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step,
                                        int count, unsigned* differences) {
  constexpr int kLeft = kBlockWidth / 2;
  block -= kRows * step + kLeft, others -= kRows * step + kLeft;
  __m256i rows[2 * kRows + 1];
#pragma GCC unroll 16
  for (int row = 0; row <= 2 * kRows; ++row)
    rows[row] = _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(block + row * step)));
  const __m256i reverse =
      _mm256_broadcastsi128_si256(_mm_setr_epi8(14, 15, 12, 13, 10, 11, 8, 9, 6, 7, 4, 5, 2, 3, 0, 1));
  for (int done = 0; done < count; done += kAtOnce) {
    const int k = std::min(done, count - kAtOnce);
    const std::uint8_t* leftmost = others - k - (kAtOnce - 1);
    __m256i sums = _mm256_setzero_si256();  // 16 bits hold them: 11 rows of 16 bytes
#pragma GCC unroll 16
    for (int row = 0; row <= 2 * kRows; ++row) {
      const __m256i left_half = loadTwice(leftmost + row * step), right_half = loadTwice(leftmost + row * step + 8);
      // The last argument: which four columns, and where the others' begin.
      sums = _mm256_add_epi16(sums, _mm256_mpsadbw_epu8(left_half, rows[row], 0b000'000));
      sums = _mm256_add_epi16(sums, _mm256_mpsadbw_epu8(left_half, rows[row], 0b101'101));
      sums = _mm256_add_epi16(sums, _mm256_mpsadbw_epu8(right_half, rows[row], 0b010'010));
      sums = _mm256_add_epi16(sums, _mm256_mpsadbw_epu8(right_half, rows[row], 0b111'111));
    }
    const __m256i turned = _mm256_shuffle_epi8(sums, reverse);
    auto* to = reinterpret_cast<__m256i*>(differences + k);
    _mm256_storeu_si256(to, _mm256_cvtepu16_epi32(_mm256_extracti128_si256(turned, 1)));
    _mm256_storeu_si256(to + 1, _mm256_cvtepu16_epi32(_mm256_castsi256_si128(turned)));
  }
}
#elif defined(SDVO_HAVE_NEON)
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
#endif

}  // namespace

template <int kRows>
void blockDifferences(const std::uint8_t* block, const std::uint8_t* others, std::ptrdiff_t step, int count,
                      unsigned* differences) {
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels() && count >= kAtOnce)
    return blockDifferencesWithAvx2<kRows>(block, others, step, count, differences);
#elif defined(SDVO_HAVE_NEON)
  if (usesVectorKernels()) return blockDifferencesWithNeon<kRows>(block, others, step, count, differences);
#endif
  runKernel<BlockDifferences<kRows>>(block, others, step, count, differences);
}

template void blockDifferences<4>(const std::uint8_t*, const std::uint8_t*, std::ptrdiff_t, int, unsigned*);
template void blockDifferences<5>(const std::uint8_t*, const std::uint8_t*, std::ptrdiff_t, int, unsigned*);

}  // namespace sdvo
