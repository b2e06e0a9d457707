#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "../../src/front_end/fast_corners.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo {

namespace test_fast_corners {

void expectCornersOfOpenCv(const cv::Mat& image, int threshold) {
  std::vector<cv::KeyPoint> expected;
  cv::FAST(image, expected, threshold, true);
  withEveryKernel([&] {
    const std::vector<cv::KeyPoint> found = findFastCorners(image, threshold);
    ASSERT_EQ(found.size(), expected.size()) << image.size() << ", threshold " << threshold;
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].pt, expected[i].pt) << image.size() << ", threshold " << threshold;
      ASSERT_EQ(found[i].response, expected[i].response) << found[i].pt << ", threshold " << threshold;
    }
  });
}

TEST(FastCorners, AreThoseOfOpenCv) {
  for (const int threshold : {1, 12, 40, 100, 254}) {
    const cv::Mat image = synthetic::noise({317, 113}, 3);
    expectCornersOfOpenCv(image, threshold);
    cv::Mat smooth;
    cv::GaussianBlur(image, smooth, {}, 1.5);
    expectCornersOfOpenCv(smooth, threshold);
    cv::Mat extremes = image > 200;  // nothing but 0 and 255: the largest scores
    expectCornersOfOpenCv(extremes, threshold);
  }
}

TEST(FastCorners, AreThoseOfOpenCvInImagesOfAnySize) {
  for (int width = 1; width <= 110; ++width)
    expectCornersOfOpenCv(synthetic::noise({width, 23}, static_cast<unsigned>(width)), 10);
  for (int height = 1; height <= 12; ++height)
    expectCornersOfOpenCv(synthetic::noise({70, height}, static_cast<unsigned>(height)), 10);
}

/// Noise of 28 grey levels asks for as much.
TEST(FastCorners, NoContrastIsLargerThanAByte) {
  const cv::Mat extremes = synthetic::noise({317, 113}, 3) > 200;
  withEveryKernel([&] {
    for (const int threshold : {255, 256, 260, 900}) EXPECT_TRUE(findFastCorners(extremes, threshold).empty());
  });
}

TEST(FastCorners, AreThoseOfOpenCvInPartsOfImages) {
  const cv::Mat image = synthetic::noise({200, 90}, 5);
  expectCornersOfOpenCv(image(cv::Rect(13, 7, 101, 61)), 20);
}

}  // namespace test_fast_corners

namespace test_corner_peak {

/// Blurred noise.
cv::Mat texture(cv::Size size, unsigned seed) {
  cv::Mat image = synthetic::noise(size, seed);
  cv::GaussianBlur(image, image, {}, 1.2);
  return image;
}

/// The highest threshold that a pixel passes as a FAST corner, and one more: by asking cv::FAST at each of them.
int contrastAt(const cv::Mat& image, const cv::Point& pixel) {
  const cv::Mat around = image(cv::Rect(pixel - cv::Point(3, 3), cv::Size(7, 7)));
  for (int threshold = 255; threshold > 0; --threshold) {
    std::vector<cv::KeyPoint> corners;
    cv::FAST(around, corners, threshold - 1, false);
    if (!corners.empty()) return threshold;
  }
  return 0;
}

double peakOf(double before, double here, double after) {
  const double bend = 2.0 * here - before - after;
  return bend > 0.0 ? std::clamp(0.5 * (after - before) / bend, -1.0, 1.0) : 0.0;
}

TEST(CornerPeak, IsTheMaximumOfTwoParabolasThroughTheContrasts) {
  const cv::Mat image = texture({60, 50}, 5);
  const cv::Mat part = image(cv::Rect(3, 2, 51, 43));
  for (int y = 4; y < part.rows - 4; y += 2)
    for (int x = 4; x < part.cols - 4; x += 3) {
      double columns[3] = {0, 0, 0}, rows[3] = {0, 0, 0};
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
          const int contrast = contrastAt(part, {x + i - 1, y + j - 1});
          columns[i] += (j == 1 ? 2 : 1) * contrast;
          rows[j] += (i == 1 ? 2 : 1) * contrast;
        }
      const cv::Point2f peak = cornerPeak(part, {x, y});
      EXPECT_NEAR(peak.x, peakOf(columns[0], columns[1], columns[2]), 1e-6) << x << ", " << y;
      EXPECT_NEAR(peak.y, peakOf(rows[0], rows[1], rows[2]), 1e-6) << x << ", " << y;
    }
}

TEST(CornerPeak, SpotsAreBrightOrDark) {
  const auto spot = [](double height) {
    return synthetic::render({31, 31}, [height](double u, double v) {
      return 128.0 + height * std::exp(-0.25 * ((u - 15.3) * (u - 15.3) + (v - 14.8) * (v - 14.8)));
    });
  };
  for (const double height : {100.0, -100.0}) {
    const cv::Point2f peak = cornerPeak(spot(height), {15, 15});
    EXPECT_NEAR(peak.x, 0.3, 0.05) << height;
    EXPECT_NEAR(peak.y, -0.2, 0.05) << height;
  }
}

TEST(CornerPeak, IsThePixelItselfWhereThereIsNoMaximum) {
  EXPECT_EQ(cornerPeak(cv::Mat(20, 20, CV_8U, cv::Scalar(90)), {10, 10}), cv::Point2f());
  // The contrast of a bright pixel's neighbour only grows towards it.
  cv::Mat image(20, 20, CV_8U, cv::Scalar(90));
  image.at<std::uint8_t>(10, 10) = 200;
  EXPECT_EQ(cornerPeak(image, {10, 10}), cv::Point2f());
  EXPECT_EQ(cornerPeak(image, {8, 10}).y, 0.f);
}

TEST(CornerPeak, IsThePixelItselfWhereCirclesLeaveTheImage) {
  const cv::Mat image = texture({60, 50}, 5);
  int moved = 0;
  for (int y = -2; y < 53; ++y)
    for (int x = -2; x < 63; ++x) {
      const cv::Point2f peak = cornerPeak(image, {x, y});
      if (x < 4 || y < 4 || x > 55 || y > 45)
        EXPECT_EQ(peak, cv::Point2f()) << x << ", " << y;
      else
        moved += peak != cv::Point2f();
      EXPECT_LE(std::max(std::abs(peak.x), std::abs(peak.y)), 1.f);
    }
  EXPECT_GT(moved, 1000);
}

}  // namespace test_corner_peak

}  // namespace sdvo
