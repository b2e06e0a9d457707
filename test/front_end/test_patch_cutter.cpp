#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

#include "../../src/front_end/patch_cutter.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_patch_cutter {

constexpr PatchLayout kLayout{5, 1.f, 0.1f};

std::vector<std::uint8_t> cut(const cv::Mat& image, const PatchLayout& layout, float u, float v, float size) {
  std::vector<std::uint8_t> samples(static_cast<std::size_t>(layout.bytes()));
  PatchCutter(layout, image).cut(u, v, size, samples.data());
  return samples;
}

TEST(PatchCutter, SamplesAreMeansByArea) {
  const PatchLayout layouts[] = {{13, 1.f, 0.1f}, {6, 1.f, 0.1f}, {3, 2.f, 0.f}};
  EXPECT_FLOAT_EQ(kLayout.spacing(16.f), 1.6f);
  const cv::Mat image = synthetic::noise({70, 60}, 7);
  cv::RNG random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const float u = random.uniform(15.f, 54.f), v = random.uniform(15.f, 44.f), size = random.uniform(5.f, 20.f);
    const PatchLayout layout = layouts[trial % 3];
    const std::vector<std::uint8_t> samples = cut(image, layout, u, v, size);
    for (int k = 0; k < layout.bytes(); ++k) {
      const double spacing = layout.spacing(size), middle = 0.5 * (layout.side - 1);
      const double x = u + spacing * (k % layout.side - middle), y = v + spacing * (k / layout.side - middle);
      ASSERT_NEAR(samples[static_cast<std::size_t>(k)], synthetic::meanByArea(image, x, y, 0.5 * spacing), 0.51)
          << u << " " << v;
    }
  }
}

TEST(PatchCutter, AnyProcessorGivesTheSameBytes) {
  const cv::Mat image = synthetic::noise({70, 60}, 5);
  cv::RNG random(6);
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

TEST(PatchCutter, AcrossTheBorderSquaresInsideAreWholeAndNothingIsReadFromOutside) {
  const cv::Mat image(30, 30, CV_8U, cv::Scalar(90));
  for (const std::uint8_t sample : cut(image, kLayout, 0.f, 29.f, 7.f))
    EXPECT_TRUE(sample == 90 || sample == 0) << int{sample};
  const std::vector<std::uint8_t> samples = cut(image, kLayout, 0.f, 15.f, 7.f);
  const int side = kLayout.side;
  for (int row = 0; row < side; ++row) {
    for (int column = side / 2; column < side; ++column)
      EXPECT_EQ(samples[static_cast<std::size_t>(row * side + column)], 90) << row << ", " << column;
    EXPECT_EQ(samples[static_cast<std::size_t>(row * side)], 0) << row;
  }
}

}  // namespace sdvo::test_patch_cutter
