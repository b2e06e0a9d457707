#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../src/front_end/image_copies.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo {

namespace test_half_image {

/// OpenCV fuses products and sums on ARM, we never: there a mean near the middle of two grey levels may become the
/// other one.
#ifdef __aarch64__
constexpr double kRounding = 1.0;  // grey levels
#else
constexpr double kRounding = 0.0;
#endif

void expectHalfOfOpenCv(cv::Size size) {
  const cv::Mat image = synthetic::noise(size, static_cast<unsigned>(size.area()));
  cv::Mat expected, half;
  cv::resize(image, expected, cv::Size((size.width + 1) / 2, (size.height + 1) / 2), 0.0, 0.0, cv::INTER_AREA);
  halveImage(image, half);
  ASSERT_EQ(half.size(), expected.size());
  ASSERT_LE(cv::norm(half, expected, cv::NORM_INF), kRounding) << size;
}

TEST(HalfImage, IsThatOfOpenCv) {
  for (const int width : {16, 17, 31, 64, 125, 641, 1226, 1241, 1242})
    for (const int height : {16, 19, 77, 370, 375, 376}) expectHalfOfOpenCv({width, height});
}

}  // namespace test_half_image

namespace test_image_margin {

TEST(ImageMargin, IsTheReplicatedBorderOfOpenCv) {
  const cv::Mat whole = synthetic::noise({60, 40}, 7);
  cv::Mat larger;
  for (const cv::Rect part : {cv::Rect(0, 0, 60, 40), cv::Rect(3, 5, 41, 17), cv::Rect(9, 9, 1, 1)})
    for (const int margin : {0, 1, 17, 64}) {
      cv::Mat expected;
      cv::copyMakeBorder(whole(part), expected, margin, margin, margin, margin,
                         cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
      addMargin(whole(part), margin, larger);
      ASSERT_EQ(larger.size(), expected.size());
      EXPECT_EQ(cv::norm(larger, expected, cv::NORM_INF), 0.0) << part << ", " << margin;
    }
}

}  // namespace test_image_margin

}  // namespace sdvo
