#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "stereo_descriptor_vo/common/processor.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

namespace sdvo {
namespace test_patch_sampling {

constexpr int kMargin = 5, kWidth = 30, kHeight = 20;

/// Grey levels without any order, over a picture of kWidth x kHeight and its margin.
cv::Mat noise() {
  cv::Mat image(kHeight + 2 * kMargin, kWidth + 2 * kMargin, CV_8U);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0.0, 256.0);
  return image;
}

/// Bilinear interpolation between the four pixels around a position of the picture.
double interpolated(const cv::Mat& image, double x, double y) {
  const double column = std::floor(x), row = std::floor(y), a = x - column, b = y - row;
  const auto pixel = [&](int dx, int dy) {
    return static_cast<double>(
        image.at<std::uint8_t>(static_cast<int>(row) + dy + kMargin, static_cast<int>(column) + dx + kMargin));
  };
  return (1.0 - a) * (1.0 - b) * pixel(0, 0) + a * (1.0 - b) * pixel(1, 0) + (1.0 - a) * b * pixel(0, 1) +
         a * b * pixel(1, 1);
}

void expectSampled(float x, float y, float slant, int radius, int columns) {
  const int rows = 2 * radius + 1;
  const cv::Mat image = noise();
  constexpr float kUntouched = -1e6f;
  std::vector<float> patch(static_cast<std::size_t>(rows * columns + 1), kUntouched);
  samplePatch(image, kMargin, x, y, slant, radius, columns, patch.data());
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      EXPECT_NEAR(patch[static_cast<std::size_t>(j * columns + i)],
                  interpolated(image, x - radius + i - slant * (j - radius), y - radius + j), 2e-3)
          << "at (" << x << ", " << y << "), slant " << slant << ", row " << j << ", column " << i;
  EXPECT_EQ(patch.back(), kUntouched);
}

TEST(SamplePatch, GivesThePixelsAtWholePositions) {
  expectSampled(10.f, 8.f, 0.f, 2, 5);
  expectSampled(0.f, 0.f, 0.f, 3, 7);  // reaches into the margin
}

TEST(SamplePatch, InterpolatesBetweenPixels) {
  expectSampled(10.25f, 8.f, 0.f, 2, 5);
  expectSampled(10.f, 8.75f, 0.f, 2, 5);
  expectSampled(10.6f, 8.3f, 0.f, 3, 7);
  expectSampled(-0.4f, -0.7f, 0.f, 2, 5);
}

TEST(SamplePatch, RowsGoOnBeyondTheSquare) {
  expectSampled(10.6f, 8.3f, 0.f, 2, 8);
}

TEST(SamplePatch, SlantShiftsRowsFromTheCentre) {
  expectSampled(12.f, 9.f, 1.f, 2, 5);  // by whole pixels
  expectSampled(12.3f, 9.6f, 0.3f, 3, 8);
  expectSampled(12.3f, 9.6f, -0.7f, 3, 8);
}

TEST(SamplePatch, IsTheSameToTheBitWithAndWithoutVectors) {
  if (!usesVectorKernels()) GTEST_SKIP() << "this processor has neither AVX2 nor NEON";
  cv::Mat image(120, 150, CV_8U);
  cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::RNG random(7);
  constexpr int kBorder = 50;
  for (int trial = 0; trial < 500; ++trial) {
    const float x = random.uniform(0.f, 49.f), y = random.uniform(0.f, 19.f), slant = random.uniform(-0.8f, 0.8f);
    const int radius = 1 + trial % 20, columns = 2 * radius + 1 + trial % 7;
    std::vector<float> fast(static_cast<std::size_t>((2 * radius + 1) * columns)), plain = fast;
    samplePatch(image, kBorder, x, y, slant, radius, columns, fast.data());
    allowVectorKernels(false);
    samplePatch(image, kBorder, x, y, slant, radius, columns, plain.data());
    allowVectorKernels(true);
    ASSERT_EQ(fast, plain) << "radius " << radius << ", " << columns << " columns";
  }
}

TEST(PatchStride, IsTheSideRoundedUpToWholeRegisters) {
  for (int radius = 1; radius <= 20; ++radius) {
    EXPECT_GE(patchStride(radius), 2 * radius + 1);
    EXPECT_LT(patchStride(radius), 2 * radius + 1 + 4);
    EXPECT_EQ(patchStride(radius) % 4, 0);
  }
}

}  // namespace test_patch_sampling
}  // namespace sdvo
