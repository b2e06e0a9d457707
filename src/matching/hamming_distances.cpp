#include "hamming_distances.hpp"

#include <cstring>

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#elif defined(SDVO_HAVE_NEON)
#include <arm_neon.h>
#endif

// The population count of 64 bits is one instruction on every x86 processor since 2008, but only a function compiled
// for it may use it; the loader picks the right version.
// The thread sanitizer is not up yet when the loader picks.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SDVO_POPCOUNT __attribute__((target_clones("popcnt", "default")))
#else
#define SDVO_POPCOUNT
#endif

namespace sdvo {
namespace {

SDVO_POPCOUNT void distancesByWords(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates,
                                    std::size_t count, float* distances) {
  constexpr int kBytes = 32;  // of these every base descriptor has a multiple
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* other = others.ptr(candidates[k]);
    int distance = 0, byte = 0;
    for (; byte + kBytes <= others.cols; byte += kBytes)
#pragma GCC unroll 4
      for (int word = byte; word < byte + kBytes; word += 8) {
        std::uint64_t a, b;
        std::memcpy(&a, descriptor + word, 8);
        std::memcpy(&b, other + word, 8);
        distance += __builtin_popcountll(a ^ b);
      }
    for (; byte < others.cols; ++byte)
      distance += __builtin_popcount(static_cast<unsigned>(descriptor[byte] ^ other[byte]));
    distances[k] = static_cast<float>(distance);
  }
}

#ifdef SDVO_HAVE_AVX2
#define SDVO_VECTOR_POPCOUNT __attribute__((target("avx512vl,avx512bw,avx512vpopcntdq")))

/// Processors since Ice Lake and Zen 4 count the bits of several words at once.
bool hasVectorPopcount() {
  static const bool has = __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
                          __builtin_cpu_supports("avx512vpopcntdq");
  return has;
}

SDVO_VECTOR_POPCOUNT inline __m256i loadBytes(const std::uint8_t* bytes) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes));
}

SDVO_VECTOR_POPCOUNT void distancesByRegisters(const std::uint8_t* descriptor, const cv::Mat& others,
                                               const int* candidates, std::size_t count, float* distances) {
  constexpr int kBytes = 32;
  const int whole = others.cols / kBytes * kBytes;
  const __mmask32 rest = (1u << (others.cols - whole)) - 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* other = others.ptr(candidates[k]);
    __m256i sums = _mm256_setzero_si256();
    const auto add = [&](__m256i a, __m256i b) SDVO_VECTOR_POPCOUNT {
      sums = _mm256_add_epi64(sums, _mm256_popcnt_epi64(_mm256_xor_si256(a, b)));
    };
    for (int byte = 0; byte < whole; byte += kBytes) add(loadBytes(descriptor + byte), loadBytes(other + byte));
    if (rest != 0) add(_mm256_maskz_loadu_epi8(rest, descriptor + whole), _mm256_maskz_loadu_epi8(rest, other + whole));
    const __m128i halves = _mm_add_epi64(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    distances[k] = static_cast<float>(_mm_extract_epi64(halves, 0) + _mm_extract_epi64(halves, 1));
  }
}
#elif defined(SDVO_HAVE_NEON)
void distancesWithNeon(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates, std::size_t count,
                       float* distances) {
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
#endif

}  // namespace

void hammingDistances(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates, std::size_t count,
                      float* distances) {
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels() && hasVectorPopcount())
    return distancesByRegisters(descriptor, others, candidates, count, distances);
#elif defined(SDVO_HAVE_NEON)
  if (usesVectorKernels()) return distancesWithNeon(descriptor, others, candidates, count, distances);
#endif
  distancesByWords(descriptor, others, candidates, count, distances);
}

}  // namespace sdvo
