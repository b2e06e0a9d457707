#include <gtest/gtest.h>

#include "../../src/front_end/exposure_balance.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"

namespace sdvo::test_exposure_balance {

struct Pair : synthetic::Views {
  void balance() { balanceExposures(cv::mean(left)[0], cv::mean(right)[0], left, right); }
};

/// A textured plane 10 m ahead; the right image is another exposure of it.
Pair exposed(double gain, double offset = 0.0) {
  static const synthetic::Views equal = synthetic::planeAt(10.0, 3);
  Pair pair{{equal.left, {}}};
  equal.right.convertTo(pair.right, CV_8U, gain, offset);
  return pair;
}

TEST(ExposureBalance, TheDarkerImageTakesTheLevelsOfTheBrighterOne) {
  for (const double gain : {0.4, 0.7, 1.6, 3.0}) {
    const Pair before = exposed(gain);
    Pair after = before;
    after.balance();
    EXPECT_NEAR(cv::mean(after.left)[0], cv::mean(after.right)[0], 3.0) << gain;
    const bool right_is_brighter = gain > 1.0;
    EXPECT_TRUE(synthetic::equalMats(before.left, after.left) != right_is_brighter) << gain;
    EXPECT_TRUE(synthetic::equalMats(before.right, after.right) == right_is_brighter) << gain;
  }
}

TEST(ExposureBalance, ALevelBecomesTheOneThatItWasMadeOf) {
  cv::Mat left(256, 256, CV_8U), right;
  for (int y = 0; y < left.rows; ++y)
    for (int x = 0; x < left.cols; ++x) left.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(x);
  left.convertTo(right, CV_8U, 0.5, 10.0);
  Pair pair{{left, right}};
  pair.balance();
  EXPECT_EQ(pair.left.data, left.data);
  EXPECT_LE(cv::norm(pair.right, left, cv::NORM_INF), 1.0);
}

TEST(ExposureBalance, WhatIsSaturatedInOneIsSaturatedInBoth) {
  Pair pair = exposed(3.0);
  const int saturated = cv::countNonZero(pair.right == 255);
  ASSERT_GT(saturated, pair.right.size().area() / 10);
  pair.balance();
  EXPECT_NEAR(cv::countNonZero(pair.left == 255), saturated, 0.1 * saturated);
}

TEST(ExposureBalance, ImagesThatDifferLittleOrShowNothingAreLeftAlone) {
  for (const double gain : {0.95, 1.0, 1.05, 0.02}) {
    const Pair before = exposed(gain);
    Pair after = before;
    after.balance();
    EXPECT_EQ(after.left.data, before.left.data) << gain;
    EXPECT_EQ(after.right.data, before.right.data) << gain;
  }
}

TEST(ExposureBalance, FeaturesAreFoundWhateverTheGainOfOneSide) {
  const auto features = [](const Pair& pair) {
    return FeatureExtractor({}).extract(synthetic::camera(), pair.left, pair.right, 0).count();
  };
  const int wanted = features(exposed(1.0));
  ASSERT_GT(wanted, 300);
  EXPECT_GT(features(exposed(0.4)), 0.9 * wanted);
  EXPECT_GT(features(exposed(1.6)), 0.9 * wanted);
  EXPECT_GT(features(exposed(0.5, 110.0)), 0.9 * wanted);
  EXPECT_GT(features(exposed(2.5)), 0.5 * wanted);
}

TEST(ExposureBalance, APartThatIsCoveredOnOneSideSpoilsNoOtherOne) {
  const auto features = [](Pair pair, bool is_covered) {
    if (is_covered)
      pair.right(cv::Rect(pair.right.cols / 2, pair.right.rows / 2, pair.right.cols / 2, pair.right.rows / 2))
          .setTo(10);
    return FeatureExtractor({}).extract(synthetic::camera(), pair.left, pair.right, 0).count();
  };
  EXPECT_GT(features(exposed(1.0), true), 0.6 * features(exposed(1.0), false));
  EXPECT_GT(features(exposed(1.6), true), 0.6 * features(exposed(1.6), false)) << "beside another exposure";
}

}  // namespace sdvo::test_exposure_balance
