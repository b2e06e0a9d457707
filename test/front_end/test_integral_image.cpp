#include <gtest/gtest.h>

#include "../../src/front_end/integral_image.hpp"

namespace sdvo::test_integral_image {

/// Three columns, two rows; pixel (u, v) covers [u - 0.5, u + 0.5] x [v - 0.5, v + 0.5].
const cv::Mat kSmall = (cv::Mat_<std::uint8_t>(2, 3) << 10, 20, 40, 80, 160, 240);

TEST(IntegralImage, BoxesBetweenPixelsWeighByArea) {
  const IntegralImage image(kSmall);
  EXPECT_EQ(image.boxMean(0.5, 0.5, 1.0), (10 + 20 + 80 + 160) / 4.f);
  EXPECT_EQ(image.boxMean(1.5, 0.5, 1.0), (20 + 40 + 160 + 240) / 4.f);
  EXPECT_EQ(image.boxMean(0.5, 0.0, 0.5), (10 + 20) / 2.f);
  EXPECT_EQ(image.boxMean(2.0, 0.5, 0.5), (40 + 240) / 2.f);
  EXPECT_EQ(image.boxMean(0.25, 0.0, 0.5), 0.75f * 10 + 0.25f * 20);
  EXPECT_EQ(image.boxMean(1.0, 0.75, 0.5), 0.25f * 20 + 0.75f * 160);
  EXPECT_EQ(image.boxMean(1.0, 1.0, 0.125), 160.f);  // a part of one pixel
  // Half of the first column, the second one, all of it from both rows.
  EXPECT_EQ(image.boxMean(0.75, 0.5, 0.75),
            static_cast<float>((0.5 * 0.75 * (10 + 80) + 0.75 * (20 + 160)) / 2.25 * 1.0));
}

TEST(IntegralImage, RowsAndColumnsAreNotMixedUp) {
  const cv::Mat tall = (cv::Mat_<std::uint8_t>(7, 2) << 10, 20, 40, 80, 160, 240, 30, 60, 7, 90, 200, 1, 55, 33);
  const cv::Mat wide = tall.t();
  const IntegralImage image(tall), turned(wide);
  for (int v = 0; v < 7; ++v)
    for (int u = 0; u < 2; ++u) {
      EXPECT_EQ(image.boxMean(u, v, 0.5), tall.at<std::uint8_t>(v, u)) << u << ", " << v;
      EXPECT_EQ(turned.boxMean(v, u, 0.5), tall.at<std::uint8_t>(v, u)) << u << ", " << v;
    }
}

TEST(IntegralImage, EqualMeansAreEqualNumbers) {
  const IntegralImage image(cv::Mat(40, 50, CV_8U, cv::Scalar(77)));
  for (double u = 8.1; u < 40.0; u += 0.37)
    for (const double half : {0.5, 1.3, 7.7}) EXPECT_EQ(image.boxMean(u, 20.3, half), 77.f) << u << ", " << half;
}

/// More white pixels than 32 bits can count the grey levels of.
TEST(IntegralImage, HoldsLargeImages) {
  const cv::Size size(4100, 2200);
  cv::Mat white(size, CV_8U, cv::Scalar(255));
  white.at<std::uint8_t>(2190, 4090) = 0;
  const IntegralImage image(white);
  EXPECT_EQ(image.boxMean(20.25, 20.5, 10.0), 255.f);
  // Somewhere on these rows the sum passes 2^31.
  for (double u = 3700.0; u < 4000.0; u += 7.25) EXPECT_EQ(image.boxMean(u, 2150.0, 20.0), 255.f) << u;
  EXPECT_EQ(image.boxMean(4080.0, 2180.0, 5.0), 255.f);
  EXPECT_EQ(image.boxMean(4090.0, 2190.0, 0.5), 0.f);
  EXPECT_NEAR(image.boxMean(4090.0, 2190.0, 2.5), 255.f * 24.f / 25.f, 1.0 / 512.0);
}

/// Far from the left border all that lies beside a box is more than a float can count.
TEST(IntegralImage, AWideImageIsAsExact) {
  const IntegralImage image(cv::Mat(40, 16000, CV_8U, cv::Scalar(255)));
  for (float u = 15000.f; u < 15040.f; u += 1.25f) EXPECT_EQ(image.boxMean(u, 20.5f, 5.f), 255.f) << u;
}

}  // namespace sdvo::test_integral_image
