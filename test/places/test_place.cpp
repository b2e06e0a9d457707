#include <gtest/gtest.h>

#include "../../src/places/place_index.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_place {

/// Features of rising response, nine tenths of them in the top left corner of the image.
StereoFeatures crowded() {
  std::mt19937 random(1);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  for (int i = 0; i < 1000; ++i) {
    const bool corner = i % 10 != 0;
    const double u = corner ? 10.0 + i % 60 : static_cast<double>(random() % 640);
    const double v = corner ? 10.0 + i % 100 : static_cast<double>(random() % 480);
    synthetic::addFeature(features, u, v, 5.0, synthetic::randomRow(random, 128));
    features.response.back() = static_cast<float>(i);
  }
  features.patch_layout.side = 3;
  features.patches = cv::Mat::zeros(1000, 9, CV_8U);
  return features;
}

TEST(ThinOut, SpreadsWhatItKeepsAndPrefersTheStrongest) {
  const StereoFeatures features = crowded();
  const StereoFeatures kept = thinOut(features, 200);
  ASSERT_EQ(kept.count(), 200);
  kept.check();
  int corner = 0;
  float weakest_of_corner = 1e9f;
  for (int i = 0; i < kept.count(); ++i) {
    if (kept.u[i] >= 80.f || kept.v[i] >= 120.f) continue;
    ++corner;
    weakest_of_corner = std::min(weakest_of_corner, kept.response[i]);
  }
  EXPECT_LT(corner, 120) << "of 200, where nine tenths of all are";
  EXPECT_GT(weakest_of_corner, 800.f);
}

TEST(ThinOut, KeepsRowsTogetherAndLeavesPatchesBehind) {
  const StereoFeatures features = crowded();
  const StereoFeatures kept = thinOut(features, 100);
  EXPECT_FALSE(kept.hasPatches());
  EXPECT_TRUE(kept.patches.empty());
  for (int i = 0; i < kept.count(); ++i) {
    const auto row = static_cast<int>(kept.response[i]);
    EXPECT_EQ(kept.u[i], features.u[row]);
    EXPECT_EQ(cv::norm(kept.descriptors.row(i), features.descriptors.row(row), cv::NORM_INF), 0.0);
  }
}

TEST(ThinOut, KeepsAllOfAFew) {
  EXPECT_EQ(thinOut(crowded(), 5000).count(), 1000);
  EXPECT_EQ(thinOut(synthetic::noFeatures(synthetic::camera()), 10).count(), 0);
}

TEST(Place, TellsItsMemory) {
  Place place;
  place.features = thinOut(crowded(), 500);
  const std::size_t rows = 500 * (128 + 7 * sizeof(float));
  EXPECT_EQ(place.bytes(), sizeof(Place) + rows);
}

}  // namespace sdvo::test_place
