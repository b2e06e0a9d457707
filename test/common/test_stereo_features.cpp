#include <gtest/gtest.h>

#include <limits>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {
namespace test_stereo_features {

using synthetic::errorOf;

StereoFeatures threeFeatures() {
  std::mt19937 random(1);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  synthetic::addFeature(features, 100.0, 50.0, 20.0, synthetic::randomRow(random, 128));
  synthetic::addFeature(features, 322.5, 236.25, 10.0, synthetic::randomRow(random, 128));
  synthetic::addFeature(features, 600.0, 400.0, 5.0, synthetic::randomRow(random, 128));
  return features;
}

TEST(StereoFeatures, AcceptsConsistentSets) {
  EXPECT_NO_THROW(threeFeatures().check());
  EXPECT_NO_THROW(synthetic::noFeatures(synthetic::camera()).check());
  EXPECT_EQ(threeFeatures().count(), 3);
}

TEST(StereoFeatures, MeasurementAndPointAgree) {
  const StereoFeatures features = threeFeatures();
  EXPECT_LT((features.measurement(0) - Eigen::Vector3d(100.0, 50.0, 80.0)).norm(), 1e-12);
  // The principal ray at 10 px: depth 400 * 0.5 / 10.
  EXPECT_LT((features.point(1) - Eigen::Vector3d(0.0, 0.0, 20.0)).norm(), 1e-12);
  for (int i = 0; i < features.count(); ++i)
    EXPECT_LT((features.camera.project(features.point(i)) - features.measurement(i)).norm(), 1e-9);
}

TEST(StereoFeatures, SeenByAnotherCameraTheyAreTheSamePoints) {
  const StereoFeatures features = threeFeatures();
  const StereoCamera other{410.0, 405.0, 300.0, 250.0, 0.48, features.camera.width, features.camera.height};
  const StereoFeatures seen = features.seenBy(other);
  EXPECT_EQ(seen.camera, other);
  for (int i = 0; i < features.count(); ++i) {
    EXPECT_LT((seen.point(i) - features.point(i)).norm(), 1e-5 * features.point(i).norm());
    EXPECT_LT((seen.measurement(i) - other.project(features.point(i))).norm(), 1e-3);
    EXPECT_NEAR(seen.size[i] / features.size[i], 410.0 / 400.0, 1e-6);
  }
}

TEST(StereoFeatures, NamesTheArrayOfAnotherLength) {
  const auto expectNamed = [](const std::string& name, const std::function<void(StereoFeatures&)>& damage) {
    StereoFeatures features = threeFeatures();
    damage(features);
    EXPECT_THROW(features.check(), std::invalid_argument) << name;
    EXPECT_NE(errorOf([&] { features.check(); }).find(name), std::string::npos) << errorOf([&] { features.check(); });
  };
  expectNamed("v", [](StereoFeatures& f) { f.v.pop_back(); });
  expectNamed("disparity", [](StereoFeatures& f) { f.disparity.push_back(1.f); });
  expectNamed("dv", [](StereoFeatures& f) { f.dv.clear(); });
  expectNamed("size", [](StereoFeatures& f) { f.size.pop_back(); });
  expectNamed("angle", [](StereoFeatures& f) { f.angle.pop_back(); });
  expectNamed("response", [](StereoFeatures& f) { f.response.pop_back(); });
  expectNamed("descriptors", [](StereoFeatures& f) { f.descriptors.pop_back(); });
}

TEST(StereoFeatures, RefusesNumbersThatMeanNothing) {
  using Array = std::vector<float> StereoFeatures::*;
  const auto damaged = [](Array array, float value) {
    StereoFeatures features = threeFeatures();
    (features.*array)[1] = value;
    return errorOf([&] { features.check(); });
  };
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  const std::vector<std::pair<std::string, Array>> arrays = {{"u", &StereoFeatures::u},
                                                             {"v", &StereoFeatures::v},
                                                             {"disparity", &StereoFeatures::disparity},
                                                             {"dv", &StereoFeatures::dv},
                                                             {"size", &StereoFeatures::size},
                                                             {"angle", &StereoFeatures::angle},
                                                             {"response", &StereoFeatures::response}};
  for (const auto& [name, array] : arrays)
    for (const float bad : {kNaN, kInf, -kInf})
      EXPECT_NE(damaged(array, bad).find("array " + name + " "), std::string::npos) << name << " = " << bad;
  const std::vector<std::pair<std::string, Array>> positive = {{"disparity", &StereoFeatures::disparity},
                                                               {"size", &StereoFeatures::size}};
  for (const auto& [name, array] : positive)
    for (const float bad : {0.f, -1.f})
      EXPECT_NE(damaged(array, bad).find("array " + name + " "), std::string::npos) << name << " = " << bad;
}

TEST(StereoFeatures, RefusesDescriptorsThatAreNotRowsOfWholeElements) {
  StereoFeatures features = threeFeatures();
  features.descriptors.convertTo(features.descriptors, CV_32F);
  EXPECT_NE(errorOf([&] { features.check(); }).find("descriptors"), std::string::npos);
  features = threeFeatures();
  features.element_type = ElementType::kFloat32;
  EXPECT_NO_THROW(features.check());
  features.descriptors = features.descriptors.colRange(0, 126).clone();
  EXPECT_NE(errorOf([&] { features.check(); }).find("126 bytes of float32"), std::string::npos);
}

TEST(StereoFeatures, RefusesPatchesThatDoNotFit) {
  StereoFeatures features = threeFeatures();
  features.patch_layout = {0, 0.f, 0.f};  // as of an extractor that knows no patches
  EXPECT_NO_THROW(features.check());
  features.patch_layout = {5, 1.f, 0.1f};
  EXPECT_NE(errorOf([&] { features.check(); }).find("patches (rows)"), std::string::npos);
  features.patches = cv::Mat::zeros(3, 24, CV_8U);
  EXPECT_NE(errorOf([&] { features.check(); }).find("rows of 25 bytes"), std::string::npos);
  features.patches = cv::Mat::zeros(3, 25, CV_8U);
  EXPECT_NO_THROW(features.check());
  features.patch_layout.min_spacing = 0.f;
  EXPECT_NE(errorOf([&] { features.check(); }).find("spacing"), std::string::npos);
}

TEST(StereoFeatures, SelectedRowsStayWhole) {
  StereoFeatures features = threeFeatures();
  features.append({1.f, 2.f, 3.f, 4.f, 5.f, 6.f, 7.f});
  features.descriptors.push_back(cv::Mat(1, 128, CV_8U, cv::Scalar(77)));
  features.patch_layout = {3, 1.f, 0.f};
  features.patches.create(4, 9, CV_8U);
  for (int i = 0; i < 4; ++i) features.patches.row(i).setTo(10 * i);
  features.report.status = "as it was";
  const StereoFeatures selected = features.select({3, 1});
  EXPECT_NO_THROW(selected.check());
  EXPECT_EQ(selected.count(), 2);
  EXPECT_EQ(selected.camera, features.camera);
  EXPECT_EQ(selected.kind(), features.kind());
  EXPECT_EQ(selected.report.status, "as it was");
  EXPECT_EQ(selected.u[0], 1.f);
  EXPECT_EQ(selected.v[0], 2.f);
  EXPECT_EQ(selected.disparity[0], 3.f);
  EXPECT_EQ(selected.dv[0], 4.f);
  EXPECT_EQ(selected.size[0], 5.f);
  EXPECT_EQ(selected.angle[0], 6.f);
  EXPECT_EQ(selected.response[0], 7.f);
  EXPECT_EQ(selected.u[1], features.u[1]);
  EXPECT_TRUE(synthetic::equalMats(selected.descriptors.row(0), features.descriptors.row(3)));
  EXPECT_TRUE(synthetic::equalMats(selected.descriptors.row(1), features.descriptors.row(1)));
  EXPECT_EQ(selected.patch_layout, features.patch_layout);
  EXPECT_TRUE(synthetic::equalMats(selected.patches.row(0), features.patches.row(3)));
  EXPECT_TRUE(synthetic::equalMats(selected.patches.row(1), features.patches.row(1)));
  EXPECT_EQ(features.select({}).count(), 0);
}

TEST(StereoFeatures, RowsCompareWhereAllOfTheirKindIsEqual) {
  const DescriptorKind kind = threeFeatures().kind();
  EXPECT_TRUE(kind == threeFeatures().kind());
  DescriptorKind other = kind;
  other.descriptor = "brief";
  EXPECT_FALSE(kind == other);
  other = kind;
  other.layout = DescriptorLayout::kLeft;
  EXPECT_FALSE(kind == other);
  other = kind;
  other.element_type = ElementType::kUint8;
  EXPECT_FALSE(kind == other);
  other = kind;
  ++other.bytes;
  EXPECT_FALSE(kind == other);
}

TEST(StereoFeatures, RefusesACameraThatIsNone) {
  StereoFeatures features = threeFeatures();
  features.camera.baseline = 0.0;
  EXPECT_NE(errorOf([&] { features.check(); }).find("baseline"), std::string::npos);
}

}  // namespace test_stereo_features
}  // namespace sdvo
