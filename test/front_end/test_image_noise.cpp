#include <gtest/gtest.h>

#include "../../src/front_end/image_noise.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_image_noise {

const cv::Size kSize(400, 300);

/// A smooth scene of that brightness with white noise.
cv::Mat noisyImage(double brightness, double sigma) {
  const synthetic::Texture texture(3, 12.0, 48.0);
  cv::RNG random(7);
  return synthetic::render(kSize, [&](double u, double v) {
    return brightness * (100.0 + 0.5 * (texture.at(u, v) - 128.0)) + random.gaussian(sigma);
  });
}

TEST(ImageNoise, IsThatOfTheSensorWhateverTheLight) {
  for (const double brightness : {1.0, 0.3, 1.8})
    for (const double sigma : {0.7, 1.2, 2.0, 8.0}) {
      const double expected = std::hypot(sigma, std::sqrt(1.0 / 12.0));
      EXPECT_NEAR(noiseOf(noisyImage(brightness, sigma)), expected, 0.08 * expected) << brightness << " " << sigma;
    }
}

TEST(ImageNoise, IsAtLeastThatOfRounding) {
  for (const int grey : {0, 90, 255}) EXPECT_NEAR(noiseOf(cv::Mat(kSize, CV_8U, cv::Scalar(grey))), 0.289, 1e-3);
  EXPECT_NEAR(noiseOf(cv::Mat(1, 1, CV_8U, cv::Scalar(9))), 0.289, 1e-3);
}

/// The mean of the responses would be five times the noise here.
TEST(ImageNoise, IgnoresEdges) {
  cv::Mat image = noisyImage(1.0, 1.0);
  for (int y = 0; y < kSize.height; y += 20)
    for (int x = 0; x < kSize.width; x += 20) image(cv::Rect(x, y, 10, 10)) += 80;
  EXPECT_NEAR(noiseOf(image), 1.1, 0.2);
}

TEST(ImageNoise, IgnoresWhatIsBlackOrWhite) {
  cv::Mat image = noisyImage(1.0, 3.0);
  image.rowRange(0, 120) = 0;
  image.rowRange(120, 200) = 255;
  EXPECT_NEAR(noiseOf(image), 3.0, 0.4);
}

}  // namespace sdvo::test_image_noise
