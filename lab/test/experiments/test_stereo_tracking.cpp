#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../experiments/stereo_tracking.hpp"

namespace sdvo::test_stereo_tracking {

/// An image with texture of each level of a pyramid, and the same moved to the left by a disparity and down by `dv`,
/// px.
std::pair<cv::Mat, cv::Mat> movedPair(double disparity, double dv) {
  cv::Mat left(200, 320, CV_8U, cv::Scalar(0)), right;
  for (const double sigma : {2.0, 4.0, 8.0, 16.0}) {
    cv::Mat layer(left.size(), CV_8U);
    cv::randu(layer, 0, 255);
    cv::GaussianBlur(layer, layer, {}, sigma);
    cv::normalize(layer, layer, 0, 63, cv::NORM_MINMAX);
    left += layer;
  }
  const cv::Matx23d shift(1.0, 0.0, -disparity, 0.0, 1.0, dv);
  cv::warpAffine(left, right, shift, left.size());
  return {left, right};
}

const std::vector<cv::Point2f> kPositions = {{120.f, 60.f}, {200.f, 100.f}, {250.f, 140.f}};

TEST(StereoTracking, FindsDisparityAndRow) {
  const auto [left, right] = movedPair(31.4, 0.7);
  const std::vector<StereoMatch> matches = trackToRight(left, right, kPositions, {});
  ASSERT_EQ(matches.size(), kPositions.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(matches[i].left_index, static_cast<int>(i));
    EXPECT_NEAR(matches[i].disparity, 31.4f, 0.1f);
    EXPECT_NEAR(matches[i].dv, 0.7f, 0.1f);
  }
}

TEST(StereoTracking, LeavesOutWhatTheOptionsDoNotAllow) {
  const auto [behind, right] = movedPair(-5.0, 0.0);
  EXPECT_TRUE(trackToRight(behind, right, kPositions, {}).empty());
  const auto [left, below] = movedPair(20.0, 4.0);
  EXPECT_TRUE(trackToRight(left, below, kPositions, {}).empty());
  EXPECT_TRUE(trackToRight(left, below, {}, {}).empty());
}

}  // namespace sdvo::test_stereo_tracking
