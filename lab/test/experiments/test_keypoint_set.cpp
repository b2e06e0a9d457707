#include <gtest/gtest.h>

#include <cstdlib>

#include "../../../src/front_end/freak.hpp"
#include "../../../test/synthetic_scene.hpp"
#include "../../experiments/keypoint_set.hpp"

namespace sdvo::test_keypoint_set {

DepthScale constantSize(double size) {
  DepthScaleOptions options;
  options.scale_normalisation = false;
  options.constant_size = size;
  return DepthScale(options);
}

/// A textured wall seen by both cameras; every corner has its true disparity.
KeypointSet wall(double depth, int corners) {
  KeypointSet set;
  set.camera = synthetic::camera();
  const synthetic::Texture texture(2, 6.0 * depth / set.camera.fx, 60.0 * depth / set.camera.fx);
  set.images.left = synthetic::renderPlane(texture, set.camera, depth);
  set.images.right = synthetic::renderPlane(texture, set.camera, depth, set.camera.baseline);
  std::mt19937 random(4);
  for (int i = 0; i < corners; ++i) {
    const cv::Point2f position(static_cast<float>(random() % 6390) / 10.f, static_cast<float>(random() % 4790) / 10.f);
    set.corners.push_back(
        {{position, static_cast<float>(random() % 100)}, {0, static_cast<float>(set.camera.disparity(depth)), 0.25f}});
  }
  return set;
}

TEST(KeypointSet, ChosenKeyPointsFitBothViewsAtEverySize) {
  const KeypointSet set = wall(10.0, 3000);
  const std::vector<DepthScale> curves = {constantSize(7.0), constantSize(20.0)};
  const std::vector<int> chosen = selectKeypoints(set, curves, Freak::reach, 50, 100000);
  ASSERT_GT(chosen.size(), 200u);
  ASSERT_LT(chosen.size(), 3000u);
  const double margin = 22.0 / 7.0 * 20.0, disparity = set.camera.disparity(10.0);
  std::size_t inside = 0;
  for (const StereoCorner& c : set.corners) {
    const cv::Point2f& p = c.corner.position;
    inside +=
        p.x - disparity >= margin - 0.49 && p.x <= 639.49 - margin && p.y >= margin - 0.49 && p.y <= 479.24 - margin;
  }
  EXPECT_GE(chosen.size(), inside * 99 / 100);  // equal positions count once
  for (const int i : chosen) {
    const cv::Point2f& p = set.corners[static_cast<std::size_t>(i)].corner.position;
    EXPECT_GE(p.x - disparity, margin - 0.51);
    EXPECT_LE(p.x, 639.51 - margin);
    EXPECT_GE(p.y, margin - 0.51);
    EXPECT_LE(p.y + 0.25, 479.51 - margin);
  }
  // Together they are described as each one is alone.
  const std::vector<StereoFeatures> together = describeKeypoints(set, chosen, curves, StereoDescriptor({}));
  ASSERT_EQ(together.size(), curves.size());
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const StereoFeatures alone = describeKeypoints(set, chosen, {curves[c]}, StereoDescriptor({})).front();
    EXPECT_EQ(together[c].count(), static_cast<int>(chosen.size()));
    EXPECT_EQ(together[c].size, alone.size);
    EXPECT_TRUE(synthetic::equalMats(together[c].descriptors, alone.descriptors));
  }
}

TEST(KeypointSet, SmallerSetsAreSubsetsOfLargerOnes) {
  const KeypointSet set = wall(10.0, 3000);
  const std::vector<DepthScale> curves = {constantSize(7.0)};
  const std::vector<int> large = selectKeypoints(set, curves, Freak::reach, 50, 1000),
                         small = selectKeypoints(set, curves, Freak::reach, 50, 310);
  EXPECT_EQ(large.size(), 1000u);
  EXPECT_EQ(small.size(), 310u);
  EXPECT_TRUE(std::includes(large.begin(), large.end(), small.begin(), small.end()));
}

TEST(KeypointSet, RowsOfOneViewAreTheLeftHalves) {
  const KeypointSet set = wall(10.0, 400);
  const std::vector<int> chosen = selectKeypoints(set, {constantSize(9.0)}, Freak::reach, 50, 120);
  DescriptorOptions left_view;
  left_view.layout = DescriptorLayout::kLeft;
  const StereoFeatures both = describeKeypoints(set, chosen, {constantSize(9.0)}, StereoDescriptor({})).front();
  const StereoFeatures left = describeKeypoints(set, chosen, {constantSize(9.0)}, StereoDescriptor(left_view)).front();
  std::vector<int> rows;
  for (int i = 0; i < both.count(); i += 3) rows.push_back(i);
  const StereoFeatures halves = selectRows(both, rows, DescriptorLayout::kLeft);
  halves.check();
  ASSERT_EQ(halves.count(), static_cast<int>(rows.size()));
  EXPECT_EQ(halves.layout, DescriptorLayout::kLeft);
  for (int k = 0; k < halves.count(); ++k) {
    EXPECT_TRUE(synthetic::equalMats(halves.descriptors.row(k), left.descriptors.row(3 * k)));
    EXPECT_EQ(halves.u[static_cast<std::size_t>(k)], left.u[static_cast<std::size_t>(3 * k)]);
  }
}

/// The paper's feature sets on a real image, by every detector.
class FeatureSetSize : public testing::TestWithParam<const char*> {};

TEST_P(FeatureSetSize, IsTheWantedOneWithinFivePercent) {
  const char* kitti = std::getenv("KITTI_DIR");
  if (!kitti) GTEST_SKIP() << "KITTI_DIR is not set: feature sets of a real image are not counted";
  const KittiSequence sequence(std::string(kitti) + "/sequences/06");
  ExperimentOptions options;
  FeatureDetectorOptions& detector = options.stereo_features.detector;
  detector.type = valueOf<DetectorType>(GetParam());
  detector.max_features = 12000;
  detector.min_contrast = 6.0;
  detector.corner_quality = 0.0002;
  const KeypointSet set = findKeypoints(sequence, 10, options);
  for (const int wanted : {310, 1350, 2320}) {
    const auto chosen = selectKeypoints(set, {constantSize(7.0), constantSize(20.0)}, Freak::reach, 50, wanted);
    EXPECT_NEAR(static_cast<double>(chosen.size()), wanted, 0.05 * wanted);
  }
}

INSTANTIATE_TEST_SUITE_P(ByName, FeatureSetSize, testing::Values("fast", "gftt", "orb", "sift"),
                         [](const auto& parameter) { return std::string(parameter.param); });

}  // namespace sdvo::test_keypoint_set
