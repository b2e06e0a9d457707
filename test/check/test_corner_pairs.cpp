#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../../src/check/corner_pairs.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_corner_pairs {

/// A textured plane that is shifted by (u, v) px.
cv::Mat plane(double u, double v) {
  static const synthetic::Texture texture(3, 6.0, 120.0);
  return synthetic::render({320, 240}, [&](double x, double y) { return texture.at(x - u, y - v); });
}

TEST(CornerPairs, AreFiveASecondWithThePairBefore) {
  CornerPairs pairs;
  int taken = 0;
  for (int i = 0; i < 31; ++i)
    if (const auto pair = pairs.add(plane(i, 0.0), plane(i - 9.0, 0.0), (i + 1) * 33'000'000LL)) {
      ++taken;
      EXPECT_NEAR(pair->dt, 0.033, 1e-9);
      EXPECT_EQ(cv::norm(pair->before, plane(i - 1.0, 0.0), cv::NORM_INF), 0.0);
      EXPECT_GT(pair->corners.size(), 50u);
    }
  EXPECT_EQ(taken, 5);
  EXPECT_FALSE(
      pairs.add(cv::Mat(24, 32, CV_8U, cv::Scalar(9)), cv::Mat(24, 32, CV_8U, cv::Scalar(9)), 2'000'000'000LL));
}

/// A folder of KITTI begins at 0, a bag made of it does not.
TEST(CornerPairs, AreTheSameWhereverTheStampsBegin) {
  const auto taken = [](std::int64_t first) {
    CornerPairs pairs;
    std::vector<int> found;
    for (int i = 0; i < 8; ++i)
      if (pairs.add(plane(i, 0.0), plane(i - 9.0, 0.0), first + i * 100'000'000LL)) found.push_back(i);
    return found;
  };
  EXPECT_EQ(taken(0), taken(1'000'000'000'000'000'000LL));
}

TEST(CornerPairs, CornersAreFollowedBothWaysAndThoseThatVanishAreNot) {
  cv::Mat moved = plane(7.5, -3.25);
  moved(cv::Rect(0, 0, 160, 240)) = cv::Scalar(90);
  std::vector<cv::Point2f> corners, there;
  cv::goodFeaturesToTrack(plane(0.0, 0.0), corners, 200, 0.01, 8.0);
  const auto found = trackBothWays(plane(0.0, 0.0), moved, corners, there, 4);
  int followed = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i].x < 130.f) {
      EXPECT_FALSE(found[i]) << corners[i];
    }
    if (!found[i] || corners[i].x < 190.f || corners[i].x > 290.f) continue;
    ++followed;
    EXPECT_LT(distance(there[i], corners[i] + cv::Point2f(7.5f, -3.25f)), 0.1) << corners[i];
  }
  EXPECT_GT(followed, 20);
}

}  // namespace sdvo::test_corner_pairs
