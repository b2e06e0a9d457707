#include <gtest/gtest.h>

#include "../../src/ros/publishers/features_image.hpp"
#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_features_image {

/// Pixels that are not grey any more.
int colouredPixels(const cv::Mat& picture) {
  int count = 0;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const auto& pixel = picture.at<cv::Vec3b>(y, x);
      count += pixel[0] != pixel[1] || pixel[1] != pixel[2] ? 1 : 0;
    }
  return count;
}

TEST(DrawFeatures, DrawsCirclesOfTheDepthDerivedSizeInBothViews) {
  constexpr float kSize = 40.f;
  stereo_descriptor_vo::StereoFeatures message = someMessage();
  for (float& size : message.size) size = 1.f;
  message.u[0] = 200.f;
  message.v[0] = 200.f;
  message.disparity[0] = 50.f;
  message.dv[0] = 0.f;
  message.size[0] = kSize;
  const cv::Mat grey(370, 1226, CV_8UC1, cv::Scalar(90));
  const cv::Mat picture = drawFeatures(grey, grey, message, {}, "");
  ASSERT_EQ(picture.size(), cv::Size(1226, 740));
  const auto isColoured = [&](int x, int y) { return colouredPixels(picture(cv::Rect(x, y, 1, 1))) == 1; };
  EXPECT_TRUE(isColoured(200 + 20, 200));
  EXPECT_TRUE(isColoured(200, 200 - 20));
  EXPECT_FALSE(isColoured(200 + 16, 200));
  EXPECT_TRUE(isColoured(150 + 20, 370 + 200));
  EXPECT_FALSE(isColoured(200 + 20, 370 + 200));
}

TEST(DrawFeatures, LeavesOutFlowThatNoImageHolds) {
  stereo_descriptor_vo::FeatureFlow flow;
  flow.u_reference = {kNaN, 1e30f, 100.f};
  flow.v_reference = {1.f, 1.f, 300.f};
  flow.u = {1.f, 2.f, 140.f};
  flow.v = {1.f, kInfinity, 300.f};
  flow.inlier = {true, true, true};
  const cv::Mat grey(370, 1226, CV_8UC1, cv::Scalar(90));
  const FeaturesMessage none = toMessage(synthetic::noFeatures(someFeatures().camera), DepthScaleOptions());
  const cv::Mat picture = drawFeatures(grey, grey, none, flow, "");
  const cv::Rect line(98, 296, 46, 8);
  EXPECT_GT(colouredPixels(picture(line)), 30);
  picture(line).setTo(cv::Scalar::all(90));
  EXPECT_EQ(colouredPixels(picture), 0);
}

TEST(DrawFeatures, WordsFitIntoASmallImageAndStandOutOnWhite) {
  const FeaturesMessage none = toMessage(synthetic::noFeatures(someFeatures().camera), DepthScaleOptions());
  const auto captionOf = [&](int width, int level = 90) -> cv::Mat {
    const cv::Mat grey(240, width, CV_8UC1, cv::Scalar(level));
    cv::Mat one;
    cv::extractChannel(drawFeatures(grey, grey, none, {}, "TRACKING"), one, 0);
    return one > 170;
  };
  const int first_line = cv::countNonZero(captionOf(500).rowRange(0, 24));
  EXPECT_GT(first_line, 100);
  EXPECT_NEAR(cv::countNonZero(captionOf(500, 255).rowRange(0, 24)), first_line, 0.3 * first_line);
  for (const int width : {320, 376}) {
    const cv::Mat words = captionOf(width);
    EXPECT_EQ(cv::countNonZero(words.colRange(width - 4, width)), 0) << width << " px: cut";
    // Nothing is lost: other breaks of the lines leave the letters as many, but for some commas.
    const int letters = cv::countNonZero(words), wide = cv::countNonZero(captionOf(500));
    EXPECT_GT(letters, 0.9 * wide) << width;
  }
}

TEST(DrawFeatures, SurvivesFlowOfUnequalLengths) {
  stereo_descriptor_vo::FeatureFlow flow;
  flow.u = {1.f, 2.f};
  flow.v = {1.f};
  const cv::Mat grey(370, 1226, CV_8UC1, cv::Scalar(90));
  EXPECT_NO_THROW(drawFeatures(grey, grey, someMessage(), flow, "LOST"));
}

}  // namespace sdvo::ros_conversions::test_features_image
