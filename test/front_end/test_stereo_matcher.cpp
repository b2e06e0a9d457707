#include <gtest/gtest.h>

#include "../../src/front_end/stereo_matcher.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo {

using synthetic::Views;

namespace test_stereo_matcher {

const cv::Size kSize(640, 400);  // four pyramid levels still hold a window

/// A pair whose disparity depends on the row alone, so that the right view follows exactly; the right view is `dv`
/// lower.
Views texturedPair(const std::function<double(double v)>& disparity, double dv = 0.0) {
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

TEST(StereoMatcher, RecoversConstantDisparitiesAndAResidualMisalignment) {
  constexpr double kTolerance = 0.1;  // px
  for (const auto& [disparity, dv] : std::vector<std::pair<double, double>>{
           {0.8, 0.0}, {3.3, 0.0}, {17.6, 0.0}, {42.25, 0.0}, {9.4, 1.1}, {9.4, -0.7}}) {
    const Views pair = texturedPair([d = disparity](double) { return d; }, dv);
    const std::vector<cv::Point2f> positions = grid(disparity);
    const std::vector<StereoMatch> matches = StereoMatcher({}).match(pair.left, pair.right, positions);
    EXPECT_GE(matches.size(), positions.size() * 9 / 10);
    int previous = -1;
    for (const StereoMatch& match : matches) {
      ASSERT_GT(match.left_index, previous) << "matches are not in the order of the positions";
      previous = match.left_index;
      EXPECT_NEAR(match.disparity, disparity, kTolerance) << positions[static_cast<std::size_t>(match.left_index)];
      EXPECT_NEAR(match.dv, dv, kTolerance) << positions[static_cast<std::size_t>(match.left_index)];
    }
  }
}

/// Disparities of a plane that crosses the middle row at `middle` px and grows by `slant` px a row: the ground, whose
/// slant is baseline / height. Returns the root mean square of the errors, px.
double slantedPlaneError(double middle, double slant, double dv = 0.0) {
  const auto disparity = [=](double v) { return middle + slant * (v - 0.5 * kSize.height); };
  const Views pair = texturedPair(disparity, dv);
  const std::vector<cv::Point2f> positions = grid(disparity(kSize.height));
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
  EXPECT_LT(slantedPlaneError(45.0, 0.2, 1.1), 0.08);
}

TEST(StereoMatcher, RefusesEpipolarResidualsBeyondTheLimit) {
  for (const double dv : {2.0, -2.0}) {
    const Views pair = texturedPair([](double) { return 9.4; }, dv);
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
  const Views pair = texturedPair([](double) { return 12.0; });
  EXPECT_TRUE(StereoMatcher({}).match(pair.right, pair.left, grid(20.0)).empty());
}

TEST(StereoMatcher, RefusesDisparitiesBelowTheSmallest) {
  const Views pair = texturedPair([](double) { return 1.0; });
  StereoMatcherOptions options;
  options.min_disparity = 1.3;
  EXPECT_TRUE(StereoMatcher(options).match(pair.left, pair.right, grid(20.0)).empty());
}

TEST(StereoMatcher, FindsNextToNothingInAnotherScene) {
  const Views pair = texturedPair([](double) { return 5.0; });
  const cv::Mat unrelated = synthetic::render(kSize, synthetic::Texture(12, 5.0, 160.0));
  const std::vector<cv::Point2f> positions = grid(20.0);
  EXPECT_LE(StereoMatcher({}).match(pair.left, unrelated, positions).size(), positions.size() / 10);
}

TEST(StereoMatcher, FindsNothingInBlankImages) {
  const cv::Mat blank(kSize, CV_8U, cv::Scalar(90));
  EXPECT_TRUE(StereoMatcher({}).match(blank, blank, grid(20.0)).empty());
  const Views pair = texturedPair([](double) { return 5.0; });
  EXPECT_TRUE(StereoMatcher({}).match(pair.left, blank, grid(20.0)).empty());
  EXPECT_TRUE(StereoMatcher({}).match(pair.left, pair.right, {}).empty());
}

}  // namespace test_stereo_matcher

namespace test_epipolar_search {

const cv::Size kSize(320, 160);
constexpr double kMaxDv = 2.5;  // px

/// (disparity, dv)
std::optional<cv::Point2f> find(const Views& pair, const cv::Point2f& position, const EpipolarOptions& epipolar = {},
                                double max_dv = kMaxDv) {
  StereoMatcherOptions options;
  options.epipolar = epipolar, options.max_epipolar_residual = max_dv;
  const std::vector<StereoMatch> matches = StereoMatcher(options).match(pair.left, pair.right, {position});
  if (matches.empty()) return std::nullopt;
  return cv::Point2f(matches[0].disparity, matches[0].dv);
}

/// How many positions of the middle row are found, from u = 60 px to 280 px; where it is known, with this disparity.
int countFound(const Views& pair, float step, const EpipolarOptions& epipolar = {}, std::optional<float> d = {}) {
  int found = 0;
  for (float u = 60.f; u < 280.f; u += step) {
    const auto match = find(pair, {u, 80.f}, epipolar);
    found += match && (!d || std::abs(match->x - *d) < 0.5f);
  }
  return found;
}

/// Disparities that grow with the rows as the ground's do, in a view of these grey levels.
Views slantedPair(const std::function<double(double u, double v)>& grey, double slant) {
  return {synthetic::render(kSize, grey),
          synthetic::render(kSize, [&](double u, double v) { return grey(u + 30.0 + slant * (v - 80.0), v); })};
}

/// A smooth surface of disparity `d` everywhere, the right view `dv` lower.
Views smoothPair(double d, double dv) {
  const synthetic::Texture texture(3, 6.0, 90.0);
  return {synthetic::render(kSize, texture), synthetic::render(kSize, texture, d, dv)};
}

/// The part of `image` that a shift by (-d, dv) carries into the picture; the rest comes from `elsewhere`.
cv::Mat shifted(const cv::Mat& image, int d, int dv, const cv::Mat& elsewhere) {
  cv::Mat result = elsewhere.clone();
  for (int v = 0; v < kSize.height; ++v)
    for (int u = 0; u < kSize.width; ++u)
      if (u + d >= 0 && u + d < kSize.width && v - dv >= 0 && v - dv < kSize.height)
        result.at<std::uint8_t>(v, u) = image.at<std::uint8_t>(v - dv, u + d);
  return result;
}

/// Waves so short that an alignment from the wrong row ends at another one.
TEST(EpipolarSearch, LooksAtTheRowsAboveAndBelow) {
  const synthetic::Texture texture(4, 6.0, 24.0);
  const cv::Mat left = synthetic::render(kSize, texture);
  for (const double dv : {-2.0, -1.0, 1.0, 2.0}) {
    const Views pair{left, synthetic::render(kSize, texture, 14.0, dv)};
    int right = 0, tried = 0;
    for (float u = 60.f; u < 280.f; u += 20.f, ++tried) {
      const auto found = find(pair, {u, 80.f});
      right += found && std::abs(found->x - 14.f) < 0.1f && std::abs(found->y - dv) < 0.1;
    }
    EXPECT_GE(right, tried * 8 / 10) << "dv " << dv;
  }
}

TEST(EpipolarSearch, BrightnessAndContrastOfTheViewsMayDiffer) {
  Views pair = smoothPair(10.0, 0.0);
  pair.right.convertTo(pair.right, CV_8U, 0.9, 20.0);
  const auto found = find(pair, {150.f, 80.f});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x, 10.0, 0.1);
}

/// A twentieth of the light leaves a dozen grey levels. Noise that is as large as they are leaves nothing to align.
TEST(EpipolarSearch, WhatIsFlatFollowsTheNoiseAndNotTheLight) {
  const synthetic::Texture texture(3, 20.0, 90.0);
  const auto pair = [&](double light, double sigma) {
    cv::RNG random(8);
    const auto view = [&](double d) {
      return synthetic::render(
          kSize, [&](double u, double v) { return light * texture.at(u + d, v) + random.gaussian(sigma); });
    };
    return Views{view(0.0), view(10.0)};
  };
  EXPECT_EQ(countFound(pair(1.0, 0.3), 10.f, {}, 10.f), 22);
  EXPECT_GE(countFound(pair(0.05, 0.0), 10.f, {}, 10.f), 20);
  EXPECT_GE(countFound(pair(0.15, 0.3), 10.f, {}, 10.f), 20);
  EXPECT_LE(countFound(pair(0.05, 8.0), 10.f, {}, 10.f), 2);
}

/// A strip that repeats itself.
TEST(EpipolarSearch, RefusesWhatLooksTheSameElsewhereOnTheRow) {
  constexpr int kPeriod = 40;
  cv::Mat left = synthetic::noise(kSize, 3);
  for (int u = kPeriod; u < kSize.width; ++u) left.col(u - kPeriod).copyTo(left.col(u));
  cv::Mat disturbed(kSize, CV_16S), right;
  cv::RNG(4).fill(disturbed, cv::RNG::NORMAL, 0.0, 4.0);
  cv::add(left, disturbed, right, cv::noArray(), CV_8U);
  EXPECT_FALSE(find({left, right}, {200.f, 80.f})) << "disparities 0, 40, 80 … all fit";
  EpipolarOptions narrow;
  narrow.max_disparity = 30.0;  // only one of them is looked at
  EXPECT_TRUE(find({left, shifted(left, 6, 0, left)}, {200.f, 80.f}, narrow));
}

/// The block is the one around the position: two pixels further it would see what does not match.
TEST(EpipolarSearch, HalfResolutionBlocksAreCentredOnThePosition) {
  constexpr int kDisparity = 20;
  for (const cv::Point& position : {cv::Point(151, 81), cv::Point(150, 80), cv::Point(149, 79), cv::Point(152, 82)}) {
    // Half-resolution pixel h covers 2 h and 2 h + 1; a block has 16 x 9 of them, 8 to the left of its centre.
    const int x = 2 * (position.x / 2), y = 2 * (position.y / 2);
    const cv::Rect block(x - 16, y - 8, 32, 18);
    const cv::Mat left = synthetic::noise(kSize, 5);
    cv::Mat right = synthetic::noise(kSize, 6);
    left(block).copyTo(right(block - cv::Point(kDisparity, 0)));
    EpipolarOptions strict;
    strict.uniqueness = 0.1;  // a row and a column of noise in the block are 0.17 of what noise everywhere is
    const auto found = find({left, right}, position, strict);
    ASSERT_TRUE(found) << position;
    EXPECT_NEAR(found->x, kDisparity, 0.05) << position;
    EXPECT_NEAR(found->y, 0.0, 0.05) << position;
  }
}

TEST(EpipolarSearch, UniquenessIsARatioToTheBestBlockElsewhere) {
  // The true block, damaged a little, against noise: their ratio is known.
  constexpr int kDisparity = 20;
  const cv::Mat left = synthetic::noise(kSize, 7);
  cv::Mat right = shifted(left, kDisparity, 0, synthetic::noise(kSize, 8));
  // Half of the block's rows is replaced.
  synthetic::noise(kSize, 9).rowRange(80, 100).copyTo(right.rowRange(80, 100));
  EpipolarOptions options;
  options.min_correlation = 0.0;
  options.uniqueness = 0.3;
  EXPECT_FALSE(find({left, right}, {200.f, 80.f}, options));
  options.uniqueness = 0.9;
  EXPECT_TRUE(find({left, right}, {200.f, 70.f}, options));
}

TEST(EpipolarSearch, RefusesDisparitiesBeyondTheLargest) {
  const cv::Mat left = synthetic::noise(kSize, 11);
  const Views pair{left, shifted(left, 60, 0, synthetic::noise(kSize, 12))};
  EpipolarOptions options;
  options.max_disparity = 64.0;
  EXPECT_TRUE(find(pair, {200.f, 80.f}, options));
  options.max_disparity = 40.0;
  EXPECT_FALSE(find(pair, {200.f, 80.f}, options));
}

TEST(EpipolarSearch, RefusesAnEdgeAlongTheRow) {
  // Only the row is known there.
  const cv::Mat edge = synthetic::render(kSize, [](double, double v) { return v < 80.0 ? 60.0 : 180.0; });
  EXPECT_FALSE(find({edge, edge}, {150.f, 80.f}));
}

TEST(EpipolarSearch, RefusesASlopingEdge) {
  // Moved along itself it looks the same: neither disparity nor row is known, however well the patches agree.
  const auto edge = [](double d) {
    return synthetic::render(
        kSize, [=](double u, double v) { return 120.0 + 60.0 * std::tanh(((u + d - 150.0) + (v - 80.0)) / 4.0); });
  };
  const Views pair{edge(0.0), edge(10.3)};
  EpipolarOptions options;
  options.uniqueness = 1.0;
  options.min_correlation = 0.0;
  for (float v = 40.f; v < 120.f; v += 5.3f)
    EXPECT_FALSE(find(pair, {230.f - v, v}, options)) << "row " << v;  // on the edge
}

/// What is seen of a patch above its centre alone has the disparity of the rows above: the slant tells that of the
/// centre.
TEST(EpipolarSearch, ASlantIsToldFromADisparity) {
  const synthetic::Texture texture(5, 6.0, 40.0);
  const auto grey = [&](double u, double v) {
    const double contrast = v < 80.0 ? 1.0 : 0.15;
    return 128.0 + contrast * (texture.at(u, v) - 128.0);
  };
  for (const double slant : {0.3, -0.3}) {
    const Views pair = slantedPair(grey, slant);
    double sum = 0.0;
    int count = 0;
    for (float u = 100.f; u < 290.f; u += 10.f)
      if (const auto found = find(pair, {u, 80.f})) sum += found->x - 30.0, ++count;
    ASSERT_GE(count, 12) << slant;
    EXPECT_NEAR(sum / count, 0.0, 0.25) << slant;  // without a slant 0.3 * 3
  }
}

/// A patch that moved as a whole would agree little with short waves on slanted ground.
TEST(EpipolarSearch, PatchesAreHeldAgainstEachOtherAtTheirSlant) {
  const synthetic::Texture texture(8, 6.0, 12.0);
  EpipolarOptions options;
  options.min_correlation = 0.95;
  const Views pair = slantedPair([&](double u, double v) { return texture.at(u, v); }, 0.3);
  EXPECT_GE(countFound(pair, 10.f, options), 11) << "of 22";
}

TEST(EpipolarSearch, NeverLeavesTheRightImage) {
  // The true place of some is up to 2 px outside; whatever correlates is taken.
  const synthetic::Texture texture(6, 24.0, 90.0);
  const cv::Mat left = synthetic::render(kSize, texture);
  EpipolarOptions options;
  options.min_correlation = 0.0;
  options.uniqueness = 1.0;
  for (const double disparity : {20.0, 21.0, 30.5}) {
    const Views pair{left, synthetic::render(kSize, texture, disparity)};
    for (double outside = -2.0; outside < 2.0; outside += 0.25)
      for (float v = 20.f; v < 140.f; v += 8.f) {
        const float u = static_cast<float>(disparity - outside);
        const auto found = find(pair, {u, v}, options);
        EXPECT_TRUE(!found || u - found->x >= 0.f) << u << ", " << v;
      }
  }
}

TEST(EpipolarSearch, RefusesPatchesThatCorrelateLittle) {
  const Views clean = smoothPair(10.0, 0.0);
  Views noisy{clean.left, clean.right.clone()};
  cv::Mat disturbed(kSize, CV_16S);
  cv::RNG(15).fill(disturbed, cv::RNG::NORMAL, 0.0, 15.0);
  cv::add(noisy.right, disturbed, noisy.right, cv::noArray(), CV_8U);
  EpipolarOptions options;
  options.min_correlation = 0.97;
  EXPECT_EQ(countFound(clean, 20.f, options), 11);
  EXPECT_LE(countFound(noisy, 20.f, options), 1);
  options.min_correlation = 0.5;
  EXPECT_GE(countFound(noisy, 20.f, options), 9);
}

TEST(EpipolarSearch, FindsTheSameToTheBitWithAndWithoutVectors) {
  const Views pair = smoothPair(17.3, 0.6);
  int compared = 0;
  for (float v = 0.f; v < 160.f; v += 7.3f)
    for (float u = 0.f; u < 320.f; u += 5.7f) compared += ofEveryKernel([&] { return find(pair, {u, v}); }).has_value();
  EXPECT_GT(compared, 500);
}

}  // namespace test_epipolar_search

}  // namespace sdvo
