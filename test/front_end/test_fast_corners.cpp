#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_descriptor_vo/common/processor.hpp"
#include "stereo_descriptor_vo/front_end/fast_corners.hpp"

namespace sdvo {
namespace test_fast_corners {

void expectCornersOfOpenCv(const cv::Mat& image, int threshold) {
  std::vector<cv::KeyPoint> expected;
  cv::FAST(image, expected, threshold, true);
  const std::vector<cv::KeyPoint> found = findFastCorners(image, threshold);
  ASSERT_EQ(found.size(), expected.size()) << image.size() << ", threshold " << threshold;
  for (std::size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(found[i].pt, expected[i].pt) << image.size() << ", threshold " << threshold;
    ASSERT_EQ(found[i].response, expected[i].response) << found[i].pt << ", threshold " << threshold;
  }
}

cv::Mat noise(cv::Size size, unsigned seed) {
  cv::Mat image(size, CV_8U);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

TEST(FastCorners, AreThoseOfOpenCv) {
  for (const int threshold : {1, 12, 40, 100}) {
    const cv::Mat image = noise({317, 113}, 3);
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
    expectCornersOfOpenCv(noise({width, 23}, static_cast<unsigned>(width)), 10);
  for (int height = 1; height <= 12; ++height)
    expectCornersOfOpenCv(noise({70, height}, static_cast<unsigned>(height)), 10);
}

TEST(FastCorners, AreThoseOfOpenCvInPartsOfImages) {
  const cv::Mat image = noise({200, 90}, 5);
  expectCornersOfOpenCv(image(cv::Rect(13, 7, 101, 61)), 20);
}

TEST(FastCorners, AreTheSameWithoutVectors) {
  allowVectorKernels(false);
  expectCornersOfOpenCv(noise({150, 80}, 7), 20);
  allowVectorKernels(true);
}

}  // namespace test_fast_corners
}  // namespace sdvo
