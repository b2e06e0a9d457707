#include <gtest/gtest.h>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/front_end/stereo_matcher.hpp"

namespace sdvo::test_stereo_matcher {

const cv::Size kSize(640, 400);  // four pyramid levels still hold a window

struct Pair {
  cv::Mat left, right;
};

/// A pair whose disparity depends on the row alone, so that the right view follows exactly; the right view is `dv`
/// lower.
Pair texturedPair(const std::function<double(double v)>& disparity, double dv = 0.0) {
  const synthetic::Texture texture(11, 5.0, 160.0);
  return {synthetic::render(kSize, texture),
          synthetic::render(kSize, [&](double u, double v) { return texture.at(u + disparity(v - dv), v - dv); })};
}

/// Points of the left image whose windows lie inside both views, at positions between pixels.
std::vector<cv::Point2f> grid(double largest_disparity) {
  std::vector<cv::Point2f> positions;
  for (double v = 20.3; v < kSize.height - 20.0; v += 26.1)
    for (double u = largest_disparity + 20.7; u < kSize.width - 20.0; u += 21.3)
      positions.emplace_back(static_cast<float>(u), static_cast<float>(v));
  return positions;
}

void expectDisparities(const std::function<double(double v)>& disparity, double largest, double dv = 0.0) {
  constexpr double kTolerance = 0.1;  // px
  SCOPED_TRACE("largest disparity " + std::to_string(largest));
  const Pair pair = texturedPair(disparity, dv);
  const std::vector<cv::Point2f> positions = grid(largest);
  const std::vector<StereoMatch> matches = StereoMatcher({}).match(pair.left, pair.right, positions);
  EXPECT_GE(matches.size(), positions.size() * 9 / 10);
  int previous = -1;
  for (const StereoMatch& match : matches) {
    ASSERT_GT(match.left_index, previous) << "matches are not in the order of the positions";
    previous = match.left_index;
    const cv::Point2f& position = positions[static_cast<std::size_t>(match.left_index)];
    EXPECT_NEAR(match.disparity, disparity(position.y), kTolerance) << position;
    EXPECT_NEAR(match.dv, dv, kTolerance) << position;
  }
}

TEST(StereoMatcher, RecoversConstantDisparities) {
  for (const double disparity : {0.8, 3.3, 17.6, 42.25})
    expectDisparities([=](double) { return disparity; }, disparity);
}

/// Disparities of a plane that crosses the middle row at `middle` px and grows by `slant` px a row: the ground, whose
/// slant is baseline / height. Returns the root mean square of the errors, px.
double slantedPlaneError(double middle, double slant) {
  const auto disparity = [=](double v) { return middle + slant * (v - 0.5 * kSize.height); };
  const double largest = disparity(kSize.height);
  const Pair pair = texturedPair(disparity);
  const std::vector<cv::Point2f> positions = grid(largest);
  const std::vector<StereoMatch> matches = StereoMatcher({}).match(pair.left, pair.right, positions);
  EXPECT_GE(matches.size(), positions.size() * 8 / 10);
  double square = 0.0;
  for (const StereoMatch& match : matches) {
    const double error = match.disparity - disparity(positions[static_cast<std::size_t>(match.left_index)].y);
    square += error * error;
  }
  return std::sqrt(square / static_cast<double>(std::max<std::size_t>(matches.size(), 1)));
}

TEST(StereoMatcher, FollowsSlantedPlanes) {
  // A window that moves as a whole is off by half the slant times its reach on one side; the fitted slant is not.
  EXPECT_LT(slantedPlaneError(30.0, 0.08), 0.05);
  EXPECT_LT(slantedPlaneError(45.0, 0.2), 0.08);
  EXPECT_LT(slantedPlaneError(70.0, 0.33), 0.15);
  EXPECT_LT(slantedPlaneError(60.0, -0.2), 0.08);
}

TEST(StereoMatcher, MeasuresAResidualMisalignment) {
  expectDisparities([](double) { return 9.4; }, 9.4, 1.1);
  expectDisparities([](double) { return 9.4; }, 9.4, -0.7);
}

TEST(StereoMatcher, RefusesEpipolarResidualsBeyondTheLimit) {
  for (const double dv : {2.0, -2.0}) {
    const Pair pair = texturedPair([](double) { return 9.4; }, dv);
    StereoMatcherOptions options;
    options.max_epipolar_residual = 1.5;
    EXPECT_TRUE(StereoMatcher(options).match(pair.left, pair.right, grid(20.0)).empty()) << dv;
    options.max_epipolar_residual = 2.5;
    const std::vector<StereoMatch> matches = StereoMatcher(options).match(pair.left, pair.right, grid(20.0));
    EXPECT_GE(matches.size(), grid(20.0).size() * 9 / 10) << dv;
    for (const StereoMatch& match : matches) EXPECT_NEAR(match.dv, dv, 0.15);
  }
}

TEST(StereoMatcher, RefusesSwappedImages) {
  const Pair pair = texturedPair([](double) { return 12.0; });
  EXPECT_TRUE(StereoMatcher({}).match(pair.right, pair.left, grid(20.0)).empty());
}

TEST(StereoMatcher, RefusesDisparitiesBelowTheSmallest) {
  const Pair pair = texturedPair([](double) { return 1.0; });
  StereoMatcherOptions options;
  options.min_disparity = 1.3;
  EXPECT_TRUE(StereoMatcher(options).match(pair.left, pair.right, grid(20.0)).empty());
}

TEST(StereoMatcher, FindsNextToNothingInAnotherScene) {
  const synthetic::Texture other(12, 5.0, 160.0);
  const Pair pair = texturedPair([](double) { return 5.0; });
  const cv::Mat unrelated = synthetic::render(kSize, [&](double u, double v) { return other.at(u, v); });
  const std::vector<cv::Point2f> positions = grid(20.0);
  EXPECT_LE(StereoMatcher({}).match(pair.left, unrelated, positions).size(), positions.size() / 10);
}

TEST(StereoMatcher, FindsNothingInBlankImages) {
  const cv::Mat blank(kSize, CV_8U, cv::Scalar(90));
  EXPECT_TRUE(StereoMatcher({}).match(blank, blank, grid(20.0)).empty());
  const Pair pair = texturedPair([](double) { return 5.0; });
  EXPECT_TRUE(StereoMatcher({}).match(pair.left, blank, grid(20.0)).empty());
  EXPECT_TRUE(StereoMatcher({}).match(pair.left, pair.right, {}).empty());
}

TEST(StereoMatcher, NeverLeavesTheRightImage) {
  const Pair pair = texturedPair([](double) { return 30.0; });
  std::vector<cv::Point2f> positions;
  for (float u = 0.f; u < 60.f; u += 1.7f) positions.emplace_back(u, 100.f);
  for (const StereoMatch& match : StereoMatcher({}).match(pair.left, pair.right, positions))
    EXPECT_GE(positions[static_cast<std::size_t>(match.left_index)].x - match.disparity, 0.f);
}

}  // namespace sdvo::test_stereo_matcher
