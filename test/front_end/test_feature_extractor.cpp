#include <gtest/gtest.h>

#include "../../src/front_end/depth_scale.hpp"
#include "../../src/front_end/freak.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"

namespace sdvo::test_feature_extractor {

using synthetic::planeAt;
using synthetic::Views;

FeatureExtractorOptions fewFeatures() {
  FeatureExtractorOptions options;
  options.detector.max_features = 400;
  return options;
}

StereoFeatures extract(const Views& pair, const FeatureExtractorOptions& options = fewFeatures(),
                       std::int64_t stamp = 0, const StereoCamera& camera = synthetic::camera()) {
  return FeatureExtractor(options).extract(camera, pair.left, pair.right, stamp);
}

/// A disparity of 267 px in an image of 640.
TEST(FeatureExtractor, FollowsAPlaneThatIsNearerThanTheSearchReaches) {
  const StereoFeatures features = extract(planeAt(0.75));
  EXPECT_FALSE(features.report.refused) << features.report.status;
  const auto right = std::count_if(features.disparity.begin(), features.disparity.end(),
                                   [](float disparity) { return std::abs(disparity - 266.7f) < 1.f; });
  EXPECT_GT(right, 50);
  EXPECT_GE(right, features.count() * 9 / 10);
}

TEST(FeatureExtractor, MeasuresAPlaneAtKnownDepth) {
  const StereoCamera camera = synthetic::camera();
  FeatureExtractorOptions options = fewFeatures();
  options.size_curve.slope = 0.8;
  options.size_curve.min_size = 4.0;
  options.size_curve.max_size = 40.0;
  for (const double depth : {8.0, 16.0}) {
    const StereoFeatures features = extract(planeAt(depth), options, 1234);
    ASSERT_NO_THROW(features.check());
    EXPECT_GE(features.count(), 200);
    EXPECT_EQ(features.stamp, 1234);
    EXPECT_EQ(features.camera, camera);
    EXPECT_EQ(features.descriptor, "freak");
    EXPECT_EQ(features.layout, DescriptorLayout::kLeftAndRight);
    EXPECT_EQ(features.descriptors.cols, 128);
    EXPECT_TRUE(features.report.status.empty()) << features.report.status;
    EXPECT_LE(features.report.detected, 400);
    EXPECT_GE(features.report.detected, features.report.stereo_matched);
    EXPECT_GE(features.report.stereo_matched, features.count());

    const double disparity = camera.fx * camera.baseline / depth;
    int precise = 0;
    for (int i = 0; i < features.count(); ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      precise += std::abs(features.disparity[k] - disparity) < 0.1 && std::abs(features.dv[k]) < 0.1;
      EXPECT_NEAR(features.size[k], 0.8 * features.disparity[k], 1e-4);
    }
    // Windows at the borders see too little.
    EXPECT_GE(precise, features.count() * 95 / 100) << "depth " << depth;
  }
}

/// Each row is what FREAK says at the feature's own positions in both views: u - disparity and v + dv on the right.
TEST(FeatureExtractor, DescribesTheRightViewWhereTheFeatureIs) {
  const StereoCamera camera = synthetic::camera();
  constexpr double kDisparity = 14.0;
  const synthetic::Texture texture(33, 6.0, 96.0);
  const cv::Size size(camera.width, camera.height);
  const cv::Mat left = synthetic::render(size, texture);
  for (const double dv : {-1.2, 1.2}) {
    cv::Mat right = synthetic::render(size, texture, kDisparity, dv);
    right.rowRange(0, 160).setTo(90);  // the first corners have no match
    const StereoFeatures features = extract({left, right});
    ASSERT_GE(features.count(), 100);
    const Freak left_view(left), right_view(right);
    double apart = 0.0, mean_dv = 0.0;
    for (int i = 0; i < features.count(); ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      cv::Mat expected(1, 2 * Freak::kBytes, CV_8U);
      left_view.describe({{features.u[k], features.v[k], features.size[k], -1.f}}, {expected.ptr()});
      right_view.describe(
          {{features.u[k] - features.disparity[k], features.v[k] + features.dv[k], features.size[k], -1.f}},
          {expected.ptr() + Freak::kBytes});
      EXPECT_TRUE(synthetic::equalMats(features.descriptors.row(i), expected)) << "feature " << i << ", dv " << dv;
      apart += synthetic::differingBits(features.descriptors.row(i).colRange(0, Freak::kBytes),
                                        features.descriptors.row(i).colRange(Freak::kBytes, 2 * Freak::kBytes));
      mean_dv += features.dv[k];
    }
    EXPECT_NEAR(mean_dv / features.count(), dv, 0.03);
    EXPECT_LT(apart / features.count(), 0.05) << "the halves do not show the same point";
  }
}

/// A right camera that is pitched or rolled by more than the search takes: rows lie along a line, which leads it.
TEST(FeatureExtractor, FollowsTheRowsOfARightCameraThatTurned) {
  const StereoCamera camera = synthetic::camera();
  const synthetic::Texture texture(33, 6.0, 96.0);
  const cv::Size size(camera.width, camera.height);
  const cv::Mat left = synthetic::render(size, texture);
  struct Rows {
    double offset, slope;  // px, px for each column
    bool is_refused;
    std::string words;
  };
  for (const Rows& rows : {Rows{4.0, 0.0, false, "4.0 px too low"}, Rows{0.0, 0.012, false, "0.7 degrees clockwise"},
                           Rows{9.0, 0.0, true, "9.0 px too low"}}) {
    const auto line = [&](double u) { return rows.offset + rows.slope * (u - 0.5 * size.width); };
    const cv::Mat right =
        synthetic::render(size, [&](double u, double v) { return texture.at(u + 14.0, v - line(u)); });
    const StereoFeatures features = extract({left, right});
    EXPECT_TRUE(contains(features.report.status, rows.words)) << features.report.status;
    EXPECT_EQ(features.report.refused, rows.is_refused) << "beyond a degree";
    EXPECT_EQ(features.count() >= 100, !rows.is_refused);
    double square = 0.0;
    for (int i = 0; i < features.count(); ++i) {
      const double error = features.dv[i] - line(features.u[i] - features.disparity[i]);
      square += error * error / features.count();
    }
    EXPECT_LT(square, 0.1 * 0.1);
  }
}

TEST(FeatureExtractor, DetectsWhereTheSmallestDescriptorFits) {
  // A near feature would be larger; what is far away is found as near to the border as its own size allows.
  FeatureExtractorOptions options = fewFeatures();
  options.size_curve.slope = 0.3;
  options.size_curve.min_size = 10.0;
  options.size_curve.max_size = 40.0;
  options.descriptor.extend_border = false;
  const double reach = Freak::reach(10.0);
  const StereoFeatures features = extract(planeAt(10.0), options);  // disparity 20 px
  float top = 1e9f, nearest_right_view = 1e9f;
  for (std::size_t k = 0; k < features.u.size(); ++k) {
    top = std::min(top, features.v[k]);
    nearest_right_view = std::min(nearest_right_view, features.u[k] - features.disparity[k]);
  }
  EXPECT_GE(top, reach - 0.5);
  EXPECT_LT(top, reach + 10.0);
  EXPECT_GE(nearest_right_view, reach - 0.5);
  EXPECT_LT(nearest_right_view, reach + 10.0);
}

TEST(FeatureExtractor, MeasuresBrightnessAndSharpness) {
  const StereoCamera camera = synthetic::camera();
  // Left: a ramp of one grey level per pixel that folds at 200; right: a constant.
  const cv::Mat left = synthetic::render({camera.width, camera.height}, [](double u, double) {
    const double x = std::fmod(u, 400.0);
    return x < 200.0 ? x : 400.0 - x;
  });
  const cv::Mat right(camera.height, camera.width, CV_8U, cv::Scalar(77));
  const ExtractionReport report = extract({left, right}).report;
  double mean = 0.0;
  for (int u = 0; u < camera.width; ++u) mean += left.at<std::uint8_t>(0, u) / static_cast<double>(camera.width);
  EXPECT_NEAR(report.mean_intensity[0], mean, 0.5);
  EXPECT_NEAR(report.sharpness[0], 1.0, 0.01);
  EXPECT_LT(report.noise, 0.5) << "grey levels are rounded";
  EXPECT_NEAR(report.mean_intensity[1], 77.0, 1e-9);
  EXPECT_NEAR(report.sharpness[1], 0.0, 1e-9);
}

TEST(FeatureExtractor, RefusesWrongImagesNamingTheSide) {
  const StereoCamera camera = synthetic::camera();
  const FeatureExtractor extractor(fewFeatures());
  const cv::Mat good(camera.height, camera.width, CV_8U, cv::Scalar(100));
  const cv::Mat narrow = good.colRange(0, camera.width - 1).clone(), low = good.rowRange(0, camera.height - 1).clone();
  const cv::Mat colour(camera.height, camera.width, CV_8UC3, cv::Scalar(100));
  const cv::Mat deep(camera.height, camera.width, CV_16U, cv::Scalar(100));
  for (const cv::Mat& bad : {narrow, low, colour, deep, cv::Mat()}) {
    EXPECT_EQ(errorOf([&] { extractor.extract(camera, bad, good, 0); }).rfind("left image", 0), 0u);
    EXPECT_EQ(errorOf([&] { extractor.extract(camera, good, bad, 0); }).rfind("right image", 0), 0u);
  }
  expectError([&] { extractor.extract(camera, narrow, good, 0); }, {"639x480", "640x480"});
  StereoCamera uncalibrated = camera;
  uncalibrated.fx = 0.0;
  EXPECT_THROW(extractor.extract(uncalibrated, good, good, 0), std::invalid_argument);
}

TEST(FeatureExtractor, SaysWhyAPairGivesNothing) {
  const StereoCamera camera = synthetic::camera();
  const cv::Mat black(camera.height, camera.width, CV_8U, cv::Scalar(0));
  const Views pair = planeAt(10.0);
  FeatureExtractorOptions huge = fewFeatures();
  huge.size_curve.min_size = huge.size_curve.max_size = 150.0;  // reaches 471 px
  huge.descriptor.extend_border = false;
  // Of so few rows none is as far from both borders as a descriptor reaches.
  StereoCamera flat = camera;
  flat.height = 36;
  const cv::Range rows(100, 100 + flat.height);
  for (const auto& [features, words] : std::vector<std::pair<StereoFeatures, std::string>>{
           {extract({black, black}), "corners"},
           {extract({black, pair.right}), "corners"},
           {extract({pair.left, black}), "the right image has no texture"},
           {extract({pair.right, pair.left}), "swapped"},
           {extract(pair, huge), "border"},
           {extract({pair.left.rowRange(rows), pair.right.rowRange(rows)}, fewFeatures(), 5, flat),
            "the image is too small"}}) {
    EXPECT_EQ(features.count(), 0);
    EXPECT_NO_THROW(features.check());
    expectWords(features.report.status, {words});
  }
}

/// A thermal camera's shutter: for some frames one side shows a plate, with noise, or its last image again.
TEST(FeatureExtractor, NamesTheSideThatShowsNothingOrRepeats) {
  const FeatureExtractor extractor(fewFeatures());
  const StereoCamera camera = synthetic::camera();
  const Views pair = planeAt(10.0), next = planeAt(10.0, 32);
  cv::Mat plate(pair.left.size(), CV_8U), blurred;
  cv::randn(plate, 110.0, 2.0);
  cv::GaussianBlur(next.right, blurred, {}, 15.0);
  const ExtractionReport before = extractor.extract(camera, pair.left, pair.right, 5).report;
  struct Shown {
    cv::Mat left, right;
    std::string words;
    bool refused;
  };
  for (const Shown& shown : {Shown{plate, next.right, "the left image has no texture", false},
                             Shown{next.left, plate, "the right image has no texture", false},
                             Shown{next.left, blurred, "the right image has no texture", false},
                             Shown{pair.left, next.right, "the left image repeats", true},
                             Shown{next.left, pair.right, "the right image repeats", true}}) {
    const ExtractionReport report = extractor.extract(camera, shown.left, shown.right, 6, cv::Mat(), before).report;
    expectWords(report.status, {shown.words});
    EXPECT_EQ(report.refused, shown.refused) << shown.words;
  }
  EXPECT_EQ(extractor.extract(camera, pair.left, pair.right, 6, cv::Mat(), before).report.status, "") << "both repeat";
}

TEST(FeatureExtractor, SizesFollowTheDescriptorUnlessSet) {
  const Views pair = planeAt(8.0);
  for (const DescriptorType type : {DescriptorType::kFreak, DescriptorType::kBrief, DescriptorType::kOrb}) {
    FeatureExtractorOptions options = fewFeatures();
    options.descriptor.type = type;
    const DepthScale own(DepthScaleOptions{}.completedFor(type));
    const StereoFeatures features = extract(pair, options);
    ASSERT_GE(features.count(), 200) << nameOf(type);
    for (std::size_t k = 0; k < features.size.size(); ++k)
      ASSERT_NEAR(features.size[k], own.size(features.disparity[k]), 1e-4) << nameOf(type);

    options.size_curve.min_size = options.size_curve.max_size = 12.0;
    const StereoFeatures set = extract(pair, options);
    ASSERT_GE(set.count(), 200) << nameOf(type);
    for (const float size : set.size) ASSERT_EQ(size, 12.f) << nameOf(type);
  }
}

/// Alone each value is in its range; together with the descriptor's own they leave no size.
TEST(FeatureExtractor, RefusesALimitThatTheDescriptorsOwnContradicts) {
  FeatureExtractorOptions options;
  options.size_curve.max_size = 3.0;
  expectError([&] { FeatureExtractor{options}; }, {"size_curve/min_size", "4 px", "3 px"});
}

TEST(FeatureExtractor, DescribesMostOfASmallImage) {
  // A near plane, disparity 40 px: every size is near its upper limit, 28.8 px, whose pattern is 181 px wide.
  StereoCamera small = synthetic::camera();
  small.width = 424, small.height = 240;
  small.cx -= 100.0, small.cy -= 100.0;
  const Views pair = planeAt(5.0);
  const cv::Range rows(100, 340), columns(100, 524);
  const StereoFeatures features = extract({pair.left(rows, columns), pair.right(rows, columns)}, {}, 0, small);
  ASSERT_GT(features.report.stereo_matched, 100);
  EXPECT_GT(features.count(), 0.85 * features.report.stereo_matched);
  for (const float size : features.size) EXPECT_NEAR(size, 28.8f, 0.5f);
}

TEST(FeatureExtractor, SizeCurveIsThatOfEverySizeAlsoInALowImage) {
  // The near plane's sizes, 28.8 px, have no room in 150 rows.
  StereoCamera low = synthetic::camera();
  low.height = 150;
  low.cy -= 100.0;
  const Views pair = planeAt(5.0);
  const cv::Range rows(100, 250);
  const FeatureExtractor extractor{FeatureExtractorOptions()};
  const StereoFeatures features = extractor.extract(low, pair.left.rowRange(rows), pair.right.rowRange(rows), 0);
  ASSERT_GT(features.count(), 50);
  const DepthScaleOptions curve = extractor.sizeCurve({low.width, low.height});
  EXPECT_LT(curve.max_size, 28.0);
  for (int i = 0; i < features.count(); ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    EXPECT_NEAR(features.size[k], DepthScale(curve).size(features.disparity[k]), 1e-4);
  }
  EXPECT_EQ(extractor.sizeCurve({640, 480}).max_size, extractor.options().sizeCurve().max_size);
}

TEST(FeatureExtractor, LeavesItsImagesAlone) {
  const Views pair = planeAt(8.0);
  const cv::Mat left = pair.left.clone(), right = pair.right.clone();
  extract(pair);
  EXPECT_TRUE(synthetic::equalMats(pair.left, left));
  EXPECT_TRUE(synthetic::equalMats(pair.right, right));
}

}  // namespace sdvo::test_feature_extractor
