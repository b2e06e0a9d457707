#include <gtest/gtest.h>

#include <map>

#include "../../src/tools/feature_halves.hpp"
#include "../synthetic_features.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_feature_halves {

StereoFeatures featuresAt(const std::vector<cv::Point2f>& positions) {
  StereoFeatures features;
  features.camera = {200.0, 200.0, 160.0, 120.0, 0.1, 320, 240};
  for (const cv::Point2f& position : positions) features.append({position.x, position.y, 5.f, 0.f, 10.f, -1.f, 1.f});
  return features;
}

/// The half of each row.
std::vector<int> halves(const std::array<std::vector<int>, 2>& rows) {
  std::vector<int> half(rows[0].size() + rows[1].size(), -1);
  for (int h = 0; h < 2; ++h)
    for (const int row : rows[static_cast<std::size_t>(h)]) half.at(static_cast<std::size_t>(row)) = h;
  return half;
}

TEST(FeatureHalves, HaveEveryFeatureOnceAndCoverTheImage) {
  std::vector<cv::Point2f> positions;
  for (int v = 5; v < 240; v += 10)
    for (int u = 5; u < 320; u += 10) positions.emplace_back(static_cast<float>(u), static_cast<float>(v));
  const auto rows = FeatureHalves().split(featuresAt(positions), {});
  const std::vector<int> half = halves(rows);
  ASSERT_EQ(half.size(), positions.size());
  EXPECT_EQ(std::count(half.begin(), half.end(), -1), 0) << "in both halves, so another is in none";
  for (int quarter = 0; quarter < 4; ++quarter) {
    int counts[2] = {0, 0};
    for (std::size_t i = 0; i < positions.size(); ++i)
      if ((positions[i].x < 160.f) == (quarter % 2 == 0) && (positions[i].y < 120.f) == (quarter < 2))
        ++counts[half[i]];
    EXPECT_GT(3 * std::min(counts[0], counts[1]), counts[0] + counts[1]) << "quarter " << quarter;
  }
}

TEST(FeatureHalves, KeepNeighboursTogether) {
  // Fields are a quarter of 240 px wide.
  const std::vector<int> half =
      halves(FeatureHalves().split(featuresAt({{62, 62}, {118, 118}, {122, 62}, {62, 122}}), {}));
  EXPECT_EQ(half[0], half[1]);
  EXPECT_NE(half[0], half[2]);
  EXPECT_NE(half[0], half[3]);
}

TEST(FeatureHalves, APointStaysInItsHalfWhereverItMoves) {
  FeatureHalves features;
  const std::vector<int> before = halves(features.split(featuresAt({{30, 45}, {90, 45}}), {}));
  // Each moves on by a field. The second one is not matched, the third one is said to come from where nothing was.
  const StereoFeatures next = featuresAt({{90, 45}, {150, 45}, {210, 45}});
  const std::vector<int> after =
      halves(features.split(next, {{30.5f, 44.5f, 5.f, 0, true}, {210.f, 60.f, 5.f, 2, true}}));
  EXPECT_EQ(after[0], before[0]);
  EXPECT_NE(after[1], before[1]);
  EXPECT_NE(after[2], after[1]) << "the fields of a row alternate";
  const std::vector<int> last = halves(features.split(featuresAt({{210, 45}}), {{90.f, 45.f, 5.f, 0, true}}));
  EXPECT_EQ(last[0], before[0]);
}

/// With one in two points lost to the other half at each pair, halves would have a quarter of the matches each.
TEST(FeatureHalves, FollowTheMatchesOfAnOdometry) {
  SyntheticScene scene(21, 4000, 120.0);
  VisualOdometry odometry{VisualOdometryOptions{}};
  FeatureHalves features;
  std::map<std::vector<std::uint8_t>, int> before;  // of points, which their descriptors name
  int kept = 0, all = 0;
  for (int k = 0; k < 10; ++k) {
    const StereoFeatures pair = scene.view(syntheticPose(k), (k + 1) * 100000000LL, 0.1);
    const std::vector<int> half = halves(features.split(pair, odometry.update(pair).flow));
    std::map<std::vector<std::uint8_t>, int> now;
    for (int i = 0; i < pair.count(); ++i) {
      const std::uint8_t* row = pair.descriptors.ptr(i);
      const std::vector<std::uint8_t> point(row, row + pair.descriptors.cols);
      now[point] = half[static_cast<std::size_t>(i)];
      const auto found = before.find(point);
      if (found == before.end()) continue;
      ++all;
      kept += found->second == now[point] ? 1 : 0;
    }
    before = now;
  }
  ASSERT_GT(all, 1000);
  EXPECT_GT(kept, 9 * all / 10);
}

}  // namespace sdvo::test_feature_halves
