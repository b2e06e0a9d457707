#include <gtest/gtest.h>

#include "../../src/matching/view_matcher.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_correspondences {

StereoFeatures twoFeatures() {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera(), 0);
  synthetic::addFeature(features, 100.f, 50.f, 20.f, std::vector<std::uint8_t>(128, 1));
  synthetic::addFeature(features, 500.f, 60.f, 10.f, std::vector<std::uint8_t>(128, 2));
  return features;
}

TEST(Correspondences, MeasurementsAreWithoutTheRigsError) {
  const StereoFeatures features = twoFeatures();
  EXPECT_TRUE(measurementOf(features, 0, {}).isApprox(Eigen::Vector3d(100.0, 50.0, 80.0)));
  RigCalibration rig;
  rig.value = {0.5, 0.0, 0.0};  // a disparity of 19.5 px is measured as 20 px
  EXPECT_TRUE(measurementOf(features, 0, rig).isApprox(Eigen::Vector3d(100.0, 50.0, 80.5)));
  EXPECT_TRUE(measurementOf(features, 1, rig, {0.25, -0.5}).isApprox(Eigen::Vector3d(500.25, 59.5, 490.75)))
      << "both views move by the shift";
}

TEST(Correspondences, AreInTheOrderOfTheMatches) {
  const StereoFeatures features = twoFeatures();
  DescribedPoints reference(features);
  reference.positions = {{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}};
  const auto correspondences = correspond(reference, features, {{1, 0, 0.f}, {0, 1, 0.f}}, {});
  ASSERT_EQ(correspondences.size(), 2u);
  EXPECT_EQ(correspondences[0].point, reference.positions[1]);
  EXPECT_EQ(correspondences[0].measurement, measurementOf(features, 0, {}));
  EXPECT_EQ(correspondences[1].point, reference.positions[0]);
  EXPECT_EQ(correspondences[1].measurement, measurementOf(features, 1, {}));
}

}  // namespace sdvo::test_correspondences
