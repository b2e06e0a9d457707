#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "stereo_descriptor_vo/front_end/image_margin.hpp"

namespace sdvo {
namespace test_image_margin {

TEST(ImageMargin, IsTheReplicatedBorderOfOpenCv) {
  cv::Mat whole(40, 60, CV_8U);
  cv::RNG(7).fill(whole, cv::RNG::UNIFORM, 0, 256);
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
