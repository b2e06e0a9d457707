#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "../../src/front_end/patch_cutter.hpp"
#include "../kernels.hpp"

namespace sdvo::test_patch_cutter {

constexpr PatchLayout kLayout{5, 1.f, 0.1f};

std::vector<std::uint8_t> cut(const cv::Mat& image, const PatchLayout& layout, float u, float v, float size) {
  std::vector<std::uint8_t> samples(static_cast<std::size_t>(layout.bytes()));
  PatchCutter(layout, image).cut(u, v, size, samples.data());
  return samples;
}

/// Grey level 2 x + 3 y + 10: the mean of any square is the level at its centre.
cv::Mat ramp() {
  cv::Mat image(40, 50, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(2 * x + 3 * y + 10);
  return image;
}

TEST(PatchCutter, OnePixelSpacingAtWholePixelsCopiesThem) {
  cv::Mat image(20, 20, CV_8U);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  const std::vector<std::uint8_t> samples = cut(image, kLayout, 9.f, 7.f, 7.f);
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i)
      EXPECT_EQ(samples[static_cast<std::size_t>(5 * j + i)], image.at<std::uint8_t>(5 + j, 7 + i)) << i << " " << j;
}

TEST(PatchCutter, SamplesLieAroundThePositionAtTheSizesSpacing) {
  // 16 px of size: samples 1.6 px apart; columns to the right, rows downwards.
  const float u = 20.3f, v = 15.6f, spacing = 1.6f;
  const std::vector<std::uint8_t> samples = cut(ramp(), kLayout, u, v, 16.f);
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i) {
      const float level = 2.f * (u + spacing * (i - 2)) + 3.f * (v + spacing * (j - 2)) + 10.f;
      // Pixels are squares of one level, not a slope: that and rounding.
      EXPECT_NEAR(samples[static_cast<std::size_t>(5 * j + i)], level, 0.9f) << i << " " << j;
    }
}

TEST(PatchCutter, ASampleIsTheMeanOfItsSquare) {
  // Black but for one white pixel: a square of 2 px that covers it has a quarter of its level.
  cv::Mat image = cv::Mat::zeros(21, 21, CV_8U);
  image.at<std::uint8_t>(10, 10) = 200;
  const PatchLayout layout{3, 2.f, 0.f};
  const std::vector<std::uint8_t> samples = cut(image, layout, 10.5f, 10.5f, 7.f);
  for (int k = 0; k < 9; ++k) EXPECT_EQ(samples[static_cast<std::size_t>(k)], k == 4 ? 50 : 0) << k;
}

/// Mean grey level of the square of side `spacing` around (u, v), by the area that each pixel has in it.
double meanByArea(const cv::Mat& image, double u, double v, double spacing) {
  const auto overlap = [&](int pixel, double centre) {
    return std::max(0.0, std::min(pixel + 0.5, centre + 0.5 * spacing) - std::max(pixel - 0.5, centre - 0.5 * spacing));
  };
  double sum = 0.0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) sum += overlap(x, u) * overlap(y, v) * image.at<std::uint8_t>(y, x);
  return sum / (spacing * spacing);
}

TEST(PatchCutter, SamplesAreMeansByArea) {
  cv::Mat image(60, 70, CV_8U);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  for (int trial = 0; trial < 20; ++trial) {
    const float u = random.uniform(15.f, 54.f), v = random.uniform(15.f, 44.f), size = random.uniform(5.f, 20.f);
    const PatchLayout layout{trial % 2 ? 13 : 6, 1.f, 0.1f};
    const std::vector<std::uint8_t> samples = cut(image, layout, u, v, size);
    for (int k = 0; k < layout.bytes(); ++k) {
      const double spacing = layout.spacing(size), middle = 0.5 * (layout.side - 1);
      const double x = u + spacing * (k % layout.side - middle), y = v + spacing * (k / layout.side - middle);
      ASSERT_NEAR(samples[static_cast<std::size_t>(k)], meanByArea(image, x, y, spacing), 0.51) << u << " " << v;
    }
  }
}

TEST(PatchCutter, AnyProcessorGivesTheSameBytes) {
  cv::Mat image(60, 70, CV_8U);
  cv::RNG random(5);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  for (const int side : {1, 5, 7, 8, 9, 13, 15, 16})
    for (int k = 0; k < 50; ++k) {
      // Also beyond the borders.
      const float u = random.uniform(-5.f, 75.f), v = random.uniform(-5.f, 65.f), size = random.uniform(1.f, 40.f);
      const PatchLayout layout{side, k % 2 ? 1.f : 0.5f, 0.1f};
      ofEveryKernel([&] { return cut(image, layout, u, v, size); });
    }
}

TEST(PatchCutter, SumsBeyond31BitsDoNoHarm) {
  const cv::Mat image(3000, 3000, CV_8U, cv::Scalar(255));
  for (const std::uint8_t sample : cut(image, kLayout, 2990.4f, 2990.7f, 7.f)) EXPECT_EQ(sample, 255);
}

TEST(PatchCutter, AcrossTheBorderNothingIsReadFromOutside) {
  const cv::Mat image(30, 30, CV_8U, cv::Scalar(90));
  for (const std::uint8_t sample : cut(image, kLayout, 0.f, 29.f, 7.f))
    EXPECT_TRUE(sample == 90 || sample == 0) << int{sample};
}

TEST(PatchCutter, AcrossTheBorderSquaresInsideAreWhole) {
  const cv::Mat image(30, 30, CV_8U, cv::Scalar(90));
  const std::vector<std::uint8_t> samples = cut(image, kLayout, 0.f, 15.f, 7.f);
  const int side = kLayout.side;
  for (int row = 0; row < side; ++row) {
    for (int column = side / 2; column < side; ++column)
      EXPECT_EQ(samples[static_cast<std::size_t>(row * side + column)], 90) << row << ", " << column;
    EXPECT_EQ(samples[static_cast<std::size_t>(row * side)], 0) << row;
  }
}

}  // namespace sdvo::test_patch_cutter
