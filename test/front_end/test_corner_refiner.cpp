#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/processor.hpp"
#include "stereo_descriptor_vo/front_end/corner_refiner.hpp"
#include "stereo_descriptor_vo/front_end/patch_sampling.hpp"

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
    const auto corner = CornerRefiner(image, radius, 0, scratch).refine({20.f, 15.f}, 1.5f);
    ASSERT_TRUE(corner) << radius;
    EXPECT_NEAR(corner->x, 20.3, 0.3) << radius;
    EXPECT_NEAR(corner->y, 14.6, 0.3) << radius;
  }
}

/// One step of the intersection of gradient lines from its definition, in double precision.
cv::Point2d stepOf(const cv::Mat& image, int radius, const cv::Point2f& position) {
  const int side = 2 * radius + 3;
  std::vector<float> patch(static_cast<std::size_t>(side * side));
  samplePatch(image, 0, position.x, position.y, 0.f, radius + 1, side, patch.data());
  cv::Matx22d products = cv::Matx22d::zeros();
  cv::Vec2d sum(0.0, 0.0);
  for (int y = -radius; y <= radius; ++y)
    for (int x = -radius; x <= radius; ++x) {
      const float* here = &patch[static_cast<std::size_t>((y + radius + 1) * side + x + radius + 1)];
      const cv::Vec2d gradient(here[1] - here[-1], here[side] - here[-side]);
      const cv::Matx22d product =
          std::exp(-(x * x + y * y) / static_cast<double>(radius * radius)) * gradient * gradient.t();
      products += product;
      sum += product * cv::Vec2d(x, y);
    }
  const cv::Matx21d step = products.solve(cv::Matx21d(sum[0], sum[1]));
  return {step(0), step(1)};
}

TEST(CornerRefiner, GoesWhereItsDefinitionLeads) {
  cv::Mat image(101, 123, CV_8U), scratch;
  cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {}, 1.2);
  for (const int radius : {2, 3, 4, 7}) {
    const CornerRefiner refiner(image, radius, 0, scratch);
    int found = 0;
    for (int y = 20; y < 80; y += 3)
      for (int x = 20; x < 100; x += 3) {
        const cv::Point2f start(static_cast<float>(x), static_cast<float>(y));
        const auto corner = refiner.refine(start, 1.f);
        if (!corner) continue;
        ++found;
        cv::Point2f expected = start;
        for (int iteration = 0; iteration < 10; ++iteration) {
          const cv::Point2d step = stepOf(image, radius, expected);
          expected += cv::Point2f(step);
          if (cv::norm(step) < 0.02) break;
        }
        EXPECT_LT(cv::norm(*corner - expected), 0.025) << start << ", radius " << radius;
      }
    EXPECT_GT(found, 10) << radius;
  }
}

TEST(CornerRefiner, RefusesWhatWandersOff) {
  cv::Mat scratch;
  EXPECT_FALSE(CornerRefiner(quadrant(22.4, 14.6), 3, 0, scratch).refine({20.f, 15.f}, 1.5f));
}

TEST(CornerRefiner, NeedsNoCopyWhereStartsAreFarFromTheBorder) {
  const cv::Mat image = quadrant(20.3, 14.6);
  cv::Mat copy, none;
  const auto expected = CornerRefiner(image, 2, 0, copy).refine({20.f, 15.f}, 1.5f);
  EXPECT_EQ(CornerRefiner(image, 2, 13, none).refine({20.f, 15.f}, 1.5f), expected);
  EXPECT_FALSE(copy.empty());
  EXPECT_TRUE(none.empty());
}

TEST(CornerRefiner, IsTheSameToTheBitWithAndWithoutAvx2) {
  if (!usesAvx2()) GTEST_SKIP() << "this processor has no AVX2";
  cv::Mat image(61, 83, CV_8U), scratch;
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  for (int radius = 1; radius <= 15; ++radius) {
    const CornerRefiner refiner(image, radius, 0, scratch);
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
