#include <gtest/gtest.h>

#include "../../src/front_end/repeated_texture.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_repeated_texture {

using synthetic::Views;

const cv::Size kSize(640, 400);

/// Points of the left image, at positions between pixels.
std::vector<cv::Point2f> grid() {
  std::vector<cv::Point2f> positions;
  for (float v = 20.3f; v < 380.f; v += 26.1f)
    for (float u = 25.7f; u < 620.f; u += 21.3f) positions.emplace_back(u, v);
  return positions;
}

constexpr double kPeriod = 93.7, kNearDisparity = 6.6;  // px

/// A wall of equal bays, sampled without a lens' blur, with noise; `dirt` is added to it at (u, v) of the left image.
Views bays(const std::function<double(double u, double v)>& dirt = [](double, double) { return 0.0; }) {
  const synthetic::Texture texture(41, 2.2, 40.0);
  const auto grey = [&](double u, double v) {
    return texture.at(u - kPeriod * std::floor(u / kPeriod), v) + dirt(u, v);
  };
  Views pair{synthetic::render(kSize, grey),
             synthetic::render(kSize, [&](double u, double v) { return grey(u + kNearDisparity, v); })};
  cv::RNG random(3);
  for (cv::Mat* view : {&pair.left, &pair.right}) {
    cv::Mat noise(kSize, CV_16S);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 1.5);
    cv::add(*view, noise, *view, cv::noArray(), CV_8U);
  }
  return pair;
}

/// Unique and right, unique and wrong, ambiguous.
struct Counts {
  int right = 0, wrong = 0, ambiguous = 0;
};
Counts countBays(const Views& pair, double max_disparity = 192.0) {
  StereoMatcherOptions options;
  options.epipolar.max_disparity = max_disparity;
  Counts counts;
  for (const StereoMatch& match : StereoMatcher(options).match(pair.left, pair.right, grid()))
    ++(match.period > 0.f                                 ? counts.ambiguous
       : std::abs(match.disparity - kNearDisparity) < 1.0 ? counts.right
                                                          : counts.wrong);
  return counts;
}

TEST(RepeatedTexture, TextureThatRepeatsAlongTheRowIsAmbiguous) {
  const Views pair = bays();
  const Counts counts = countBays(pair);
  EXPECT_LE(counts.wrong, 2);
  EXPECT_GT(counts.ambiguous, 200);
  int off = 0;
  for (const StereoMatch& match : StereoMatcher({}).match(pair.left, pair.right, grid())) {
    if (match.period > 0.f) {
      EXPECT_NEAR(std::remainder(match.period, kPeriod), 0.0, 0.5);
    }
    off += std::abs(match.disparity - kNearDisparity - kPeriod) < 1.0;
  }
  EXPECT_GT(off, 20) << "the better block is often the wrong one";
}

TEST(RepeatedTexture, DirtDecidesBetweenPeriods) {
  const Counts counts = countBays(bays([](double u, double v) {
    const double blot = std::sin(0.0431 * u + 0.6 * std::sin(0.05 * v)) * std::sin(0.057 * v + 0.013 * u);
    return blot > 0.8 ? -90.0 : 0.0;
  }));
  EXPECT_GT(counts.right, 150);
  EXPECT_LE(20 * counts.wrong, counts.right);
}

TEST(RepeatedTexture, ASearchBelowThePeriodIsNotAmbiguous) {
  const Counts counts = countBays(bays(), 64.0);
  EXPECT_EQ(counts.ambiguous, 0);
  EXPECT_EQ(counts.wrong, 0);
  EXPECT_GT(counts.right, 200);
}

TEST(RepeatedTexture, TextureThatDoesNotRepeatHasNoPeriod) {
  const synthetic::Texture texture(11, 5.0, 160.0);
  const cv::Mat left = synthetic::render(kSize, texture),
                right = synthetic::render(kSize, [&](double u, double v) { return texture.at(u + kNearDisparity, v); });
  for (const StereoMatch& match : StereoMatcher({}).match(left, right, grid())) EXPECT_EQ(match.period, 0.f);
}

/// Matches of a view whose texture repeats; every 16th has neither a rival nor a period, and `unique_disparity`.
std::vector<StereoMatch> marked(float unique_disparity, bool has_rivals_without_period = false) {
  const std::vector<cv::Point2f> positions = grid();
  std::vector<StereoMatch> matches;
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const bool is_unique = i % 16 == 5;
    matches.push_back(
        {static_cast<int>(i), is_unique ? unique_disparity : 31.f + static_cast<float>(i % 3) * 49.f, 0.f});
    if (!is_unique) rivals.push_back({i, 60.f});
  }
  const auto periodOf = [&](std::size_t i) {
    return i % 16 == 5 || (has_rivals_without_period && i % 5 == 2) ? 0.f : 49.f;
  };
  markRepeated(positions, rivals, periodOf, matches);
  return matches;
}

TEST(RepeatedTexture, AMatchAmongPeriodsBelowItsDisparityIsACoincidence) {
  for (const StereoMatch& match : marked(80.f)) EXPECT_GT(match.period, 0.f) << match.left_index;
}

TEST(RepeatedTexture, AMatchWhoseDisparityIsBelowThePeriodsAroundIsUnique) {
  const std::vector<StereoMatch> matches = marked(12.f);
  for (std::size_t i = 5; i < matches.size(); i += 16) EXPECT_EQ(matches[i].period, 0.f) << i;
}

TEST(RepeatedTexture, ARivalIsAsGoodAsAPeriod) {
  const std::vector<StereoMatch> matches = marked(12.f, true);
  for (std::size_t i = 2; i < matches.size(); i += 5)
    if (i % 16 != 5) {
      EXPECT_EQ(matches[i].period, 60.f) << i;
    }
}

TEST(RepeatedTexture, WhereItFillsTheViewTheRangeOfDisparitiesThatDecidesIsSaid) {
  const StereoCamera camera{300.0, 300.0, 320.0, 200.0, 0.1, kSize.width, kSize.height};
  const auto said = [&](std::size_t repeated) {
    std::vector<StereoMatch> matches(10, StereoMatch{0, 20.f, 0.f});
    for (std::size_t i = 0; i < repeated; ++i) matches[i].period = 40.f;
    const std::string words = removeRepeated(matches, camera, 192.0);
    EXPECT_EQ(matches.size(), 10 - repeated);
    return words;
  };
  EXPECT_EQ(said(5), "");
  expectWords(said(6), {"6 of 10", "0.75 m", "stereo/epipolar/max_disparity", "below 40"});
}

}  // namespace sdvo::test_repeated_texture
