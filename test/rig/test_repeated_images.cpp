#include <gtest/gtest.h>

#include "../../src/belief/motion_hypotheses.hpp"
#include "../../src/rig/repeated_images.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_repeated_images {

constexpr double kNoise = 1.0;  // px

/// Moves all points by more than the noise.
Eigen::Isometry3d ahead() {
  return Eigen::Isometry3d(Eigen::Translation3d(0.5, 0.5, 0.0));
}

StereoFeatures seen(unsigned seed) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform;
  for (int i = 0; i < 200; ++i)
    features.append(
        {640.f * uniform(random), 480.f * uniform(random), 5.f + 20.f * uniform(random), 0.f, 0.f, -1.f, 1.f});
  return features;
}

/// The new pair, with those features of the old one that `is_old` has instead.
template <class IsOld>
StereoFeatures mixed(const StereoFeatures& before, const StereoFeatures& now, const IsOld& is_old) {
  StereoFeatures features = synthetic::noFeatures(now.camera);
  for (const StereoFeatures* from : {&now, &before})
    for (int i = 0; i < from->count(); ++i)
      if (is_old(from->u[i], from->v[i]) == (from == &before))
        features.append({from->u[i], from->v[i], from->disparity[i], 0.f, 0.f, -1.f, 1.f});
  return features;
}

template <class IsOld>
void expectNewRows(const IsOld& is_old) {
  const StereoFeatures before = seen(1), torn = mixed(before, seen(2), is_old);
  RepeatedImages images;
  images.remember(before, {});
  std::vector<int> expected;
  for (int i = 0; i < torn.count(); ++i)
    if (!is_old(torn.u[i], torn.v[i])) expected.push_back(i);
  EXPECT_EQ(images.newFeatures(torn, kNoise, ahead()), expected);
}

TEST(RepeatedImages, LeavesOutWhatIsDescribedAcrossTheTear) {
  const StereoFeatures before = seen(1);
  StereoFeatures torn = mixed(before, seen(2), [](float, float v) { return v > 240.f; });
  for (const float v : {200.f, 225.f, 239.f, 240.f}) torn.append({320.f, v, 10.f, 0.f, 40.f, -1.f, 1.f});
  RepeatedImages images;
  images.remember(before, {});
  const std::vector<int> rows = images.newFeatures(torn, kNoise, ahead());
  const auto has = [&](int from_last) {
    return std::find(rows.begin(), rows.end(), torn.count() - from_last) != rows.end();
  };
  EXPECT_TRUE(has(4)) << "40 px above, and described within 20 px";
  for (const int from_last : {3, 2, 1}) EXPECT_FALSE(has(from_last));
}

TEST(RepeatedImages, LeavesOutTheOldPartOfATornImage) {
  for (const float border : {100.f, 240.f, 380.f}) {
    expectNewRows([&](float, float v) { return v > border; });
    expectNewRows([&](float, float v) { return v < border; });
  }
}

TEST(RepeatedImages, KeepsAllRowsOfOtherPairs) {
  const StereoFeatures before = seen(1), now = seen(2);
  RepeatedImages images;
  EXPECT_EQ(static_cast<int>(images.newFeatures(now, kNoise, ahead()).size()), now.count()) << "the first pair";
  images.remember(before, {});
  EXPECT_EQ(static_cast<int>(images.newFeatures(now, kNoise, ahead()).size()), now.count());
  EXPECT_EQ(static_cast<int>(images.newFeatures(before, kNoise, ahead()).size()), before.count())
      << "repeated as a whole";
  // A camera without noise stands, and something moves in the middle of its view.
  const StereoFeatures mover =
      mixed(before, now, [](float u, float v) { return u < 200.f || u > 440.f || v < 150.f || v > 330.f; });
  EXPECT_EQ(static_cast<int>(images.newFeatures(mover, kNoise, ahead()).size()), mover.count());
}

TEST(RepeatedImages, KeepsTheRowsOfACameraThatStands) {
  // Images without noise repeat; a thing that moves fills the lower part of the view.
  const StereoFeatures before = seen(1);
  const StereoFeatures now = mixed(before, seen(2), [](float, float v) { return v < 240.f; });
  RepeatedImages images;
  images.remember(before, {});
  EXPECT_LT(static_cast<int>(images.newFeatures(now, kNoise, ahead()).size()), now.count());
  EXPECT_EQ(static_cast<int>(images.newFeatures(now, kNoise, Eigen::Isometry3d::Identity()).size()), now.count());
  EXPECT_EQ(static_cast<int>(images.newFeatures(now, kNoise, std::nullopt).size()), now.count())
      << "nothing is expected";
}

/// As of a simulator without noise, which stands before it drives.
TEST(RepeatedImages, WhoseCameraStandsAndGoesOnHaveNoNoise) {
  const auto afterStanding = [](std::optional<bool> stood, std::optional<bool> goes_on) {
    RepeatedImages images;
    for (int k = 0; k < 6; ++k) images.remember(seen(1), stood);
    images.remember(seen(2), goes_on);
    return images.logOddsOfOld(0.5);
  };
  EXPECT_EQ(afterStanding(true, false), kUnsuspected);
  EXPECT_EQ(afterStanding(std::nullopt, false), 0.0) << "a stop that is doubtful";
  EXPECT_EQ(afterStanding(true, std::nullopt), 0.0) << "it is somewhere else: the driver was frozen";
}

TEST(RepeatedImages, WithNoiseAreOld) {
  EXPECT_EQ(RepeatedImages().logOddsOfOld(0.0), 0.0) << "other extractors do not measure it";
  EXPECT_EQ(RepeatedImages().logOddsOfOld(0.5), 0.0) << "none, or compressed";
  EXPECT_GT(RepeatedImages().logOddsOfOld(1.7), logOdds(0.95));
  EXPECT_EQ(RepeatedImages().logOddsOfOld(5.0), kCertain);
}

TEST(RepeatedImages, KnowsAPairToTheDigitAndWhetherItShouldHaveMoved) {
  RepeatedImages images;
  StereoFeatures pair = seen(1);
  EXPECT_FALSE(images.repeat(pair)) << "the first pair";
  images.remember(pair, {});
  EXPECT_TRUE(images.repeat(pair));
  EXPECT_TRUE(RepeatedImages::shouldHaveMoved(pair, kNoise, ahead()));
  EXPECT_FALSE(RepeatedImages::shouldHaveMoved(pair, kNoise, Eigen::Isometry3d::Identity()));
  pair.disparity[7] += 1e-3f;
  EXPECT_FALSE(images.repeat(pair));
}

}  // namespace sdvo::test_repeated_images
