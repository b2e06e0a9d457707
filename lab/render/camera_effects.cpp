#include "camera_effects.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "random.hpp"

namespace sdvo::render {

namespace {

/// Standard normal numbers at equally probable places: one lookup per pixel instead of a logarithm.
const std::vector<float>& normalTable() {
  static const std::vector<float> table = [] {
    constexpr int kCount = 1 << 14;
    std::vector<float> values(kCount);
    // Integrates the density between the places; exact enough far beyond what 8 bit can show.
    double x = -6.0, cumulative = 0.0;
    constexpr double kStep = 1e-5;
    for (int i = 0; i < kCount; ++i) {
      const double target = (i + 0.5) / kCount;
      while (cumulative < target && x < 6.0) {
        cumulative += kStep * std::exp(-0.5 * (x + 0.5 * kStep) * (x + 0.5 * kStep)) / std::sqrt(2.0 * M_PI);
        x += kStep;
      }
      values[static_cast<std::size_t>(i)] = static_cast<float>(x);
    }
    return values;
  }();
  return table;
}

}  // namespace

void CameraEffects::describe(OptionList& list) {
  list.add("noise", noise, {0.0, 50.0}, "grey levels", "standard deviation of the image noise");
  list.add("exposure", exposure, {0.0, 0.9}, "fraction", "slow change of the exposure, up and down by this");
  list.add("exposure_period", exposure_period, {0.5, 1000.0}, "s", "period of that change");
  list.add("vignetting", vignetting, {0.0, 0.95}, "fraction", "loss of light in the corners of the image");
  list.add("defocus", defocus, {0.0, 20.0}, "px", "standard deviation of the blur of the lens");
  list.add("motion_blur", motion_blur, {0.0, 0.2}, "s", "exposure time; the stamp is its middle");
}

double CameraEffects::gain(double time, std::uint64_t seed) const {
  const double phase = 2.0 * M_PI * Random(seed, 70).uniform();
  const double slow = std::sin(2.0 * M_PI * time / exposure_period + phase);
  const double slower = std::sin(2.0 * M_PI * time / (2.618 * exposure_period) + 2.0 * phase);
  return 1.0 + exposure * (0.7 * slow + 0.3 * slower);
}

cv::Mat1b CameraEffects::apply(const cv::Mat1f& brightness, double time, std::uint64_t seed,
                               std::uint64_t stream) const {
  cv::Mat1f image = brightness;
  if (defocus > 0.0) cv::GaussianBlur(brightness, image, cv::Size(), defocus, defocus, cv::BORDER_REPLICATE);
  const std::vector<float>& normal = normalTable();
  const auto white = static_cast<float>(255.0 * gain(time, seed));
  const float centre_x = 0.5f * static_cast<float>(image.cols - 1),
              centre_y = 0.5f * static_cast<float>(image.rows - 1);
  const float corner = std::max(1.0f, centre_x * centre_x + centre_y * centre_y);
  const auto loss = static_cast<float>(vignetting), deviation = static_cast<float>(noise);
  const std::uint64_t key = mixBits(seed ^ mixBits(stream));

  cv::Mat1b grey(image.size());
  for (int row = 0; row < image.rows; ++row) {
    const float dy = static_cast<float>(row) - centre_y;
    std::uint64_t random = 0;
    for (int column = 0; column < image.cols; ++column) {
      const float dx = static_cast<float>(column) - centre_x;
      float value = white * image(row, column) * (1.0f - loss * (dx * dx + dy * dy) / corner);
      if (column % 4 == 0) random = mixBits(key + static_cast<std::uint64_t>(row) * 65536u + column / 4);
      value += deviation * normal[random & 0x3fff];
      random >>= 16;
      grey(row, column) = static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
    }
  }
  return grey;
}

}  // namespace sdvo::render
