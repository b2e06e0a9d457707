#include <gtest/gtest.h>

#include <vector>

#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

namespace sdvo {
namespace {

constexpr int kMargin = 5, kWidth = 30, kHeight = 20;

/// Bilinear interpolation is exact for it, and each of its four terms shows up in a wrong weight.
double surface(double x, double y) {
  return 3.0 + 2.0 * x - 7.0 * y + 0.5 * x * y;
}

/// The surface over a picture of kWidth x kHeight, going on over the margin.
cv::Mat surfaceImage() {
  cv::Mat image(kHeight + 2 * kMargin, kWidth + 2 * kMargin, CV_32F);
  for (int row = 0; row < image.rows; ++row)
    for (int column = 0; column < image.cols; ++column)
      image.at<float>(row, column) = static_cast<float>(surface(column - kMargin, row - kMargin));
  return image;
}

void expectSampled(float x, float y, float slant, int radius, int columns) {
  const int rows = 2 * radius + 1;
  constexpr float kUntouched = -1e6f;
  std::vector<float> patch(static_cast<std::size_t>(rows * columns + 1), kUntouched);
  samplePatch(surfaceImage(), kMargin, x, y, slant, radius, columns, patch.data());
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i)
      EXPECT_NEAR(patch[static_cast<std::size_t>(j * columns + i)],
                  surface(x - radius + i - slant * (j - radius), y - radius + j), 1e-3)
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

TEST(PatchStride, IsTheSideRoundedUpToWholeRegisters) {
  for (int radius = 1; radius <= 20; ++radius) {
    EXPECT_GE(patchStride(radius), 2 * radius + 1);
    EXPECT_LT(patchStride(radius), 2 * radius + 1 + 4);
    EXPECT_EQ(patchStride(radius) % 4, 0);
  }
}

}  // namespace
}  // namespace sdvo
