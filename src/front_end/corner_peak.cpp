#include "stereo_descriptor_vo/front_end/corner_peak.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "fast_circle.hpp"

namespace sdvo {
namespace {

/// Sixteen pixels worked on at once: rows of four, of which three are of interest, and nothing.
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

/// Of the parabola through three values one apart, from the middle one.
float maximumOf(int before, int here, int after) {
  const int bend = 2 * here - before - after;
  if (bend <= 0) return 0.f;
  return std::clamp(0.5f * static_cast<float>(after - before) / static_cast<float>(bend), -1.f, 1.f);
}

}  // namespace

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
