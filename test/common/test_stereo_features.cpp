#include <gtest/gtest.h>

#include <tuple>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo::test_stereo_features {

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

void expectRefused(const Refusals<StereoFeatures>& refusals) {
  expectRefusals(
      threeFeatures(), [](const StereoFeatures& features) { features.check(); }, refusals);
}

TEST(StereoFeatures, NamesTheArrayOfAnotherLengthOrTheCameraThatIsNone) {
  expectRefused({{[](StereoFeatures& f) { f.v.pop_back(); }, "v"},
                 {[](StereoFeatures& f) { f.disparity.push_back(1.f); }, "disparity"},
                 {[](StereoFeatures& f) { f.dv.clear(); }, "dv"},
                 {[](StereoFeatures& f) { f.size.pop_back(); }, "size"},
                 {[](StereoFeatures& f) { f.angle.pop_back(); }, "angle"},
                 {[](StereoFeatures& f) { f.response.pop_back(); }, "response"},
                 {[](StereoFeatures& f) { f.descriptors.pop_back(); }, "descriptors"},
                 {[](StereoFeatures& f) { f.camera.baseline = 0.0; }, "baseline"}});
}

TEST(StereoFeatures, RefusesNumbersThatMeanNothing) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  using Array = std::vector<float> StereoFeatures::*;
  Refusals<StereoFeatures> refusals;
  for (const auto& [name, array, is_positive] : {std::tuple("u", Array(&StereoFeatures::u), false),
                                                 {"v", &StereoFeatures::v, false},
                                                 {"disparity", &StereoFeatures::disparity, true},
                                                 {"dv", &StereoFeatures::dv, false},
                                                 {"size", &StereoFeatures::size, true},
                                                 {"angle", &StereoFeatures::angle, false},
                                                 {"response", &StereoFeatures::response, false}})
    for (const float bad : {kNaN, kInf, -kInf, 0.f, -1.f})
      if (!std::isfinite(bad) || is_positive)
        refusals.emplace_back([array = array, bad](StereoFeatures& f) { (f.*array)[1] = bad; },
                              "array " + std::string(name) + " ");
  EXPECT_EQ(refusals.size(), 7u * 3u + 2u * 2u);
  for (const double bad : {double{kNaN}, double{kInf}, -1.1})  // s
    refusals.emplace_back([bad](StereoFeatures& f) { f.right_delay = bad; }, "right_delay");
  expectRefused(refusals);
}

TEST(StereoFeatures, RefusesDescriptorsThatAreNotRowsOfWholeElements) {
  StereoFeatures floats = threeFeatures();
  floats.element_type = ElementType::kFloat32;
  EXPECT_NO_THROW(floats.check());
  floats.descriptors = floats.descriptors.colRange(0, 126).clone();
  expectRefused({{[](StereoFeatures& f) { f.descriptors.convertTo(f.descriptors, CV_32F); }, "descriptors"},
                 {[&](StereoFeatures& f) { f = floats; }, "126 bytes of float32"}});
}

TEST(StereoFeatures, RefusesPatchesThatDoNotFit) {
  StereoFeatures features = threeFeatures();
  features.patch_layout = {0, 0.f, 0.f};  // as of an extractor that knows no patches
  EXPECT_NO_THROW(features.check());
  features.patch_layout = {5, 1.f, 0.1f};
  features.patches = cv::Mat::zeros(3, 25, CV_8U);
  expectRefusals(features, [](const StereoFeatures& f) { f.check(); },
                 {{[](StereoFeatures& f) { f.patches.release(); }, "patches (rows)"},
                  {[](StereoFeatures& f) { f.patches = cv::Mat::zeros(3, 24, CV_8U); }, "rows of 25 bytes"},
                  {[](StereoFeatures& f) { f.patch_layout.min_spacing = 0.f; }, "spacing"}});
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
  for (const std::function<void(DescriptorKind&)>& change :
       {std::function([](DescriptorKind& k) { k.descriptor = "brief"; }),
        std::function([](DescriptorKind& k) { k.layout = DescriptorLayout::kLeft; }),
        std::function([](DescriptorKind& k) { k.element_type = ElementType::kUint8; }),
        std::function([](DescriptorKind& k) { ++k.bytes; })}) {
    DescriptorKind other = kind;
    change(other);
    EXPECT_FALSE(kind == other);
  }
}

}  // namespace sdvo::test_stereo_features
