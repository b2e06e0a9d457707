#include "stereo_descriptor_vo/front_end/fast_corners.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/features2d.hpp>

#include "../common/kernel.hpp"
#include "fast_circle.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

constexpr int kRadius = 3;  // px, of the circle
constexpr int kBlock = 32;  // pixels worked on at once

#ifdef SDVO_HAVE_AVX2
using Offsets = std::array<std::ptrdiff_t, kCircle>;

Offsets circleOffsets(std::ptrdiff_t step) {
  Offsets offsets{};
  for (std::size_t i = 0; i < kCircle; ++i) offsets[i] = kCircleY[i] * step + kCircleX[i];
  return offsets;
}

SDVO_AVX2 inline __m256i load(const std::uint8_t* pixels) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels));
}

/// How far both differences, upwards and downwards, exceed zero: their larger one.
SDVO_AVX2 inline __m256i excess(__m256i brightest, __m256i darkest, __m256i centre) {
  return _mm256_max_epu8(_mm256_subs_epu8(brightest, centre), _mm256_subs_epu8(centre, darkest));
}

/// For 32 pixels the difference that all nine pixels of some arc exceed the centre by, upwards or downwards; zero where
/// that is not above the threshold.
SDVO_AVX2 inline __m256i contrast(const std::uint8_t* pixels, const Offsets& offsets, __m256i threshold) {
  const __m256i centre = load(pixels);
  // Every arc of nine holds two neighbours of these four.
  const __m256i north = load(pixels + offsets[0]), east = load(pixels + offsets[4]);
  const __m256i south = load(pixels + offsets[8]), west = load(pixels + offsets[12]);
  const __m256i bound = excess(_mm256_min_epu8(_mm256_max_epu8(north, south), _mm256_max_epu8(east, west)),
                               _mm256_max_epu8(_mm256_min_epu8(north, south), _mm256_min_epu8(east, west)), centre);
  const __m256i zero = _mm256_setzero_si256();
  const __m256i possible = _mm256_subs_epu8(bound, threshold);
  if (_mm256_testz_si256(possible, possible)) return zero;

  // The arc of nine that begins at an odd pixel and the one that begins right before it share eight pixels: the least
  // and the largest of 2, 4 and 8 in a row are needed from each odd pixel on alone.
  __m256i circle[kCircle], least[kCircle], largest[kCircle], least_of_4[kCircle], largest_of_4[kCircle];
#pragma GCC unroll 16
  for (std::size_t i = 0; i < kCircle; ++i) circle[i] = load(pixels + offsets[i]);
#pragma GCC unroll 8
  for (std::size_t i = 1; i < kCircle; i += 2) {
    least[i] = _mm256_min_epu8(circle[i], circle[(i + 1) % kCircle]);
    largest[i] = _mm256_max_epu8(circle[i], circle[(i + 1) % kCircle]);
  }
#pragma GCC unroll 8
  for (std::size_t i = 1; i < kCircle; i += 2) {
    least_of_4[i] = _mm256_min_epu8(least[i], least[(i + 2) % kCircle]);
    largest_of_4[i] = _mm256_max_epu8(largest[i], largest[(i + 2) % kCircle]);
  }
  __m256i brightest = zero, darkest = _mm256_set1_epi8(-1);
#pragma GCC unroll 8
  for (std::size_t i = 1; i < kCircle; i += 2) {
    const __m256i before = circle[i - 1], behind = circle[(i + 8) % kCircle];
    const __m256i low = _mm256_min_epu8(least_of_4[i], least_of_4[(i + 4) % kCircle]);
    const __m256i high = _mm256_max_epu8(largest_of_4[i], largest_of_4[(i + 4) % kCircle]);
    brightest = _mm256_max_epu8(brightest, _mm256_min_epu8(low, _mm256_max_epu8(before, behind)));
    darkest = _mm256_min_epu8(darkest, _mm256_max_epu8(high, _mm256_min_epu8(before, behind)));
  }
  const __m256i found = excess(brightest, darkest, centre);
  return _mm256_andnot_si256(_mm256_cmpeq_epi8(_mm256_subs_epu8(found, threshold), zero), found);
}

/// Contrasts of one row's pixels but those within the radius of its ends.
SDVO_AVX2 void contrastsOfRow(const std::uint8_t* row, int columns, const Offsets& offsets, int threshold,
                              std::uint8_t* contrasts) {
  const __m256i lanes = _mm256_set1_epi8(static_cast<char>(threshold));
  const int last = columns - kRadius - kBlock;  // the last block overlaps the one before it
  for (int x = kRadius; x < last + kBlock; x += kBlock) {
    const int start = std::min(x, last);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(contrasts + start), contrast(row + start, offsets, lanes));
  }
}

/// Adds the corners of row y: contrasts larger than their eight neighbours'.
SDVO_AVX2 void addMaxima(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int columns,
                         int y, std::vector<cv::KeyPoint>& corners) {
  constexpr float kDiameter = 7.f;
  for (int x = kRadius; x < columns - kRadius; x += kBlock) {
    const __m256i centre = load(here + x);
    if (_mm256_testz_si256(centre, centre)) continue;
    __m256i largest = _mm256_max_epu8(load(here + x - 1), load(here + x + 1));
    for (const std::uint8_t* row : {above, below})
      largest = _mm256_max_epu8(largest,
                                _mm256_max_epu8(load(row + x), _mm256_max_epu8(load(row + x - 1), load(row + x + 1))));
    const __m256i smaller = _mm256_cmpeq_epi8(_mm256_subs_epu8(centre, largest), _mm256_setzero_si256());
    unsigned maxima = ~static_cast<unsigned>(_mm256_movemask_epi8(smaller));
    for (; maxima != 0; maxima &= maxima - 1) {
      const int column = x + __builtin_ctz(maxima);
      // The score is the highest threshold that the corner would pass.
      corners.emplace_back(static_cast<float>(column), static_cast<float>(y), kDiameter, -1.f,
                           static_cast<float>(here[column] - 1));
    }
  }
}

std::vector<cv::KeyPoint> findWithAvx2(const cv::Mat& image, int threshold) {
  const Offsets offsets = circleOffsets(static_cast<std::ptrdiff_t>(image.step[0]));
  // Contrasts of three rows, zero beside the image.
  const std::size_t length = static_cast<std::size_t>(image.cols + 2 * kBlock);
  thread_local std::vector<std::uint8_t> memory;
  memory.assign(3 * length, 0);
  const auto contrasts = [&](int y) { return memory.data() + static_cast<std::size_t>(y % 3) * length + kBlock; };
  constexpr std::size_t kPixels = 32;  // for a corner: few images have more of them
  std::vector<cv::KeyPoint> corners;
  corners.reserve(image.total() / kPixels);
  for (int y = kRadius; y <= image.rows - kRadius; ++y) {
    if (y < image.rows - kRadius)
      contrastsOfRow(image.ptr(y), image.cols, offsets, threshold, contrasts(y));
    else
      std::memset(contrasts(y), 0, static_cast<std::size_t>(image.cols));
    if (y > kRadius) addMaxima(contrasts(y - 2), contrasts(y - 1), contrasts(y), image.cols, y - 1, corners);
  }
  return corners;
}
#endif

}  // namespace

std::vector<cv::KeyPoint> findFastCorners(const cv::Mat& image, int threshold) {
  CV_Assert(image.type() == CV_8UC1);
#ifdef SDVO_HAVE_AVX2
  const bool large_enough = image.cols >= kBlock + 2 * kRadius && image.rows > 2 * kRadius;
  if (usesVectorKernels() && large_enough) return findWithAvx2(image, threshold);
#endif
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image, corners, threshold, true);
  return corners;
}

}  // namespace sdvo
