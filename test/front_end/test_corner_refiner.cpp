#include <gtest/gtest.h>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/processor.hpp"
#include "stereo_descriptor_vo/front_end/corner_refiner.hpp"

namespace sdvo {
namespace {

/// The corner of a bright quadrant, each pixel the mean over its area.
cv::Mat quadrant(double x, double y) {
  const auto share = [](double edge, double pixel) { return std::clamp(pixel + 0.5 - edge, 0.0, 1.0); };
  return synthetic::render({41, 31}, [&](double u, double v) { return 40.0 + 160.0 * share(x, u) * share(y, v); });
}

TEST(CornerRefiner, FindsWhereTheGradientLinesMeet) {
  for (const int radius : {2, 3, 4, 5}) {
    cv::Mat scratch;
    const cv::Mat image = quadrant(20.3, 14.6);
    const auto corner = CornerRefiner(image, radius, scratch).refine({20.f, 15.f}, 1.5f);
    ASSERT_TRUE(corner) << radius;
    EXPECT_NEAR(corner->x, 20.3, 0.3) << radius;
    EXPECT_NEAR(corner->y, 14.6, 0.3) << radius;
  }
}

TEST(CornerRefiner, RefusesWhatWandersOff) {
  cv::Mat scratch;
  EXPECT_FALSE(CornerRefiner(quadrant(22.4, 14.6), 3, scratch).refine({20.f, 15.f}, 1.5f));
}

TEST(CornerRefiner, IsTheSameToTheBitWithAndWithoutAvx2) {
  if (!usesAvx2()) GTEST_SKIP() << "this processor has no AVX2";
  cv::Mat image(61, 83, CV_8U), scratch;
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  for (int radius = 1; radius <= 15; ++radius) {
    const CornerRefiner refiner(image, radius, scratch);
    for (int y = 0; y < image.rows; y += 4)
      for (int x = 0; x < image.cols; x += 3) {
        const cv::Point2f start(static_cast<float>(x), static_cast<float>(y));
        const auto fast = refiner.refine(start, 1.5f);
        allowAvx2(false);
        const auto plain = refiner.refine(start, 1.5f);
        allowAvx2(true);
        ASSERT_EQ(fast.has_value(), plain.has_value()) << start << ", radius " << radius;
        if (fast) {
          ASSERT_EQ(*fast, *plain) << start << ", radius " << radius;
        }
      }
  }
}

}  // namespace
}  // namespace sdvo
