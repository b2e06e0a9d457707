#include "fast_corners.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/features2d.hpp>

#include "../common/kernel.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

// The circle of FAST (Rosten and Drummond 2006) around a pixel.
constexpr std::size_t kCircle = 16;  // pixels on it, clockwise from above
constexpr std::array<int, kCircle> kCircleX = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr std::array<int, kCircle> kCircleY = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

constexpr int kRadius = 3;  // px, of the circle
constexpr int kBlock = 32;  // pixels worked on at once

#ifdef SDVO_HAVE_AVX2
using Offsets = std::array<std::ptrdiff_t, kCircle>;

Offsets circleOffsets(std::ptrdiff_t step) {
  Offsets offsets{};
  for (std::size_t i = 0; i < kCircle; ++i) offsets[i] = kCircleY[i] * step + kCircleX[i];
  return offsets;
}

SDVO_AVX2 inline __m256i loadPixels(const std::uint8_t* pixels) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels));
}

/// max(brightest - centre, centre - darkest, 0).
SDVO_AVX2 inline __m256i excess(__m256i brightest, __m256i darkest, __m256i centre) {
  return _mm256_max_epu8(_mm256_subs_epu8(brightest, centre), _mm256_subs_epu8(centre, darkest));
}

/// Contrasts of 32 pixels: the largest difference to the centre that all nine pixels of an arc have, brighter or
/// darker; zero if that is not above the threshold.
SDVO_AVX2 inline __m256i contrast(const std::uint8_t* pixels, const Offsets& offsets, __m256i threshold) {
  const __m256i centre = loadPixels(pixels);
  // Every arc of nine holds two neighbours of these four.
  const __m256i north = loadPixels(pixels + offsets[0]), east = loadPixels(pixels + offsets[4]);
  const __m256i south = loadPixels(pixels + offsets[8]), west = loadPixels(pixels + offsets[12]);
  const __m256i bound = excess(_mm256_min_epu8(_mm256_max_epu8(north, south), _mm256_max_epu8(east, west)),
                               _mm256_max_epu8(_mm256_min_epu8(north, south), _mm256_min_epu8(east, west)), centre);
  const __m256i zero = _mm256_setzero_si256();
  const __m256i possible = _mm256_subs_epu8(bound, threshold);
  if (_mm256_testz_si256(possible, possible)) return zero;

  // The arc of nine that begins at an odd pixel and the one that begins right before it share eight pixels: the least
  // and the largest of 2, 4 and 8 in a row are needed from each odd pixel on alone.
  __m256i circle[kCircle], least[kCircle], largest[kCircle], least_of_4[kCircle], largest_of_4[kCircle];
#pragma GCC unroll 16
  for (std::size_t i = 0; i < kCircle; ++i) circle[i] = loadPixels(pixels + offsets[i]);
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

/// Contrasts of a row's pixels, without kRadius of them at both ends.
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
    const __m256i centre = loadPixels(here + x);
    if (_mm256_testz_si256(centre, centre)) continue;
    __m256i largest = _mm256_max_epu8(loadPixels(here + x - 1), loadPixels(here + x + 1));
    for (const std::uint8_t* row : {above, below})
      largest = _mm256_max_epu8(
          largest,
          _mm256_max_epu8(loadPixels(row + x), _mm256_max_epu8(loadPixels(row + x - 1), loadPixels(row + x + 1))));
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

/// Three rows of four pixels in a register; its last four bytes are unused.
typedef std::uint8_t Pixels __attribute__((vector_size(16)));

Pixels smaller(const Pixels& a, const Pixels& b) {
  return a < b ? a : b;
}

Pixels larger(const Pixels& a, const Pixels& b) {
  return a > b ? a : b;
}

/// Three rows of four pixels.
Pixels neighbourhood(const std::uint8_t* first, std::size_t step) {
  typedef std::uint32_t Rows __attribute__((vector_size(16)));
  const auto row = [&](std::size_t y) {
    std::uint32_t four;
    std::memcpy(&four, first + y * step, sizeof four);
    return four;
  };
  const Rows rows = {row(0), row(1), row(2), 0};
  Pixels pixels;
  std::memcpy(&pixels, &rows, sizeof pixels);
  return pixels;
}

/// Contrasts of the three rows of four pixels that begin at `first`.
Pixels contrasts(const std::uint8_t* first, std::size_t step) {
  // The arc of nine that begins at an odd pixel and the one that begins right before it share eight pixels: the least
  // and the largest of 1, 2, 4 and 8 in a row are needed from each odd pixel on alone.
  std::array<Pixels, kCircle> circle, least, largest;
  for (std::size_t i = 0; i < kCircle; ++i)
    circle[i] = neighbourhood(first + kCircleY[i] * static_cast<std::ptrdiff_t>(step) + kCircleX[i], step);
  least = largest = circle;
  for (const std::size_t length : {1, 2, 4}) {
    const auto least_before = least, largest_before = largest;
    for (std::size_t i = 1; i < kCircle; i += 2) {
      least[i] = smaller(least_before[i], least_before[(i + length) % kCircle]);
      largest[i] = larger(largest_before[i], largest_before[(i + length) % kCircle]);
    }
  }
  const Pixels centre = neighbourhood(first, step);
  Pixels brightest = centre, darkest = centre;
  for (std::size_t i = 1; i < kCircle; i += 2) {
    const Pixels &before = circle[i - 1], &behind = circle[(i + 8) % kCircle];
    brightest = larger(brightest, smaller(least[i], larger(before, behind)));
    darkest = smaller(darkest, larger(largest[i], smaller(before, behind)));
  }
  return larger(brightest - centre, centre - darkest);
}

/// Offset of the maximum of the parabola through the values at -1, 0 and 1.
float maximumOf(int before, int here, int after) {
  const int bend = 2 * here - before - after;
  if (bend <= 0) return 0.f;
  return std::clamp(0.5f * static_cast<float>(after - before) / static_cast<float>(bend), -1.f, 1.f);
}

}  // namespace

std::vector<cv::KeyPoint> findFastCorners(const cv::Mat& image, int threshold) {
  CV_Assert(image.type() == CV_8UC1);
  threshold = std::min(threshold, 255);  // no contrast is larger; vectors, OpenCV's as well, would see its lowest byte
#ifdef SDVO_HAVE_AVX2
  const bool large_enough = image.cols >= kBlock + 2 * kRadius && image.rows > 2 * kRadius;
  if (usesVectorKernels() && large_enough) return findWithAvx2(image, threshold);
#endif
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image, corners, threshold, true);
  return corners;
}

cv::Point2f cornerPeak(const cv::Mat& image, const cv::Point& pixel) {
  CV_Assert(image.type() == CV_8UC1);
  constexpr int kReach = 4;  // px, of the circles of its neighbours
  const cv::Rect inside(kReach, kReach, image.cols - 2 * kReach, image.rows - 2 * kReach);
  if (!inside.contains(pixel)) return {};
  // The fourth pixel of a row may not lie beyond what the circles need.
  const int left = std::min(pixel.x - 1, image.cols - kReach - 3);
  const Pixels around = contrasts(image.ptr(pixel.y - 1, left), image.step[0]);
  std::array<std::uint8_t, sizeof(Pixels)> values;
  std::memcpy(values.data(), &around, sizeof around);
  const auto at = [&](int x, int y) {
    return static_cast<int>(values[static_cast<std::size_t>(4 * y + x + pixel.x - 1 - left)]);
  };

  std::array<int, 3> columns, rows;  // the middle counts twice
  for (int i = 0; i < 3; ++i) {
    columns[static_cast<std::size_t>(i)] = at(i, 0) + 2 * at(i, 1) + at(i, 2);
    rows[static_cast<std::size_t>(i)] = at(0, i) + 2 * at(1, i) + at(2, i);
  }
  return {maximumOf(columns[0], columns[1], columns[2]), maximumOf(rows[0], rows[1], rows[2])};
}

}  // namespace sdvo
