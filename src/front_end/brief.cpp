#include "brief.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

namespace sdvo {
namespace {

/// One test: is the image brighter at a than at b? Offsets at the standard size, px.
struct Test {
  double ax, ay, bx, by;
};

/// Normal deviate by Box and Muller; std::normal_distribution may differ between standard libraries.
double normal(std::mt19937& random) {
  const auto uniform = [&] { return (static_cast<double>(random()) + 0.5) / 4294967296.0; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(CV_2PI * uniform());
}

std::array<Test, Brief::kBits> drawTests(double half_patch) {
  constexpr std::uint32_t kSeed = 2010;
  std::mt19937 random(kSeed);
  // Variance (patch side)^2 / 25 as in the paper, section 3.2.
  const auto coordinate = [&] { return std::clamp(normal(random) * 2.0 * half_patch / 5.0, -half_patch, half_patch); };
  std::array<Test, Brief::kBits> tests;
  for (Test& test : tests) test = {coordinate(), coordinate(), coordinate(), coordinate()};
  return tests;
}

}  // namespace

void Brief::describe(double u, double v, double size, std::uint8_t* descriptor) const {
  static const std::array<Test, kBits> tests = drawTests(kHalfPatch);
  const double scale = size / kStandardSize;
  const auto half = static_cast<float>(std::max(kHalfBox * scale, 0.5));
  const auto mean = [&](double x, double y) {
    return image_.boxMean(static_cast<float>(u + scale * x), static_cast<float>(v + scale * y), half);
  };
  std::memset(descriptor, 0, kBytes);
  for (int bit = 0; bit < kBits; ++bit) {
    const Test& test = tests[bit];
    const bool brighter = mean(test.ax, test.ay) > mean(test.bx, test.by);
    descriptor[bit / 8] = static_cast<std::uint8_t>(descriptor[bit / 8] | brighter << (bit % 8));
  }
}

}  // namespace sdvo
