#include <gtest/gtest.h>

#include "../../src/front_end/feature_detector.hpp"
#include "message_samples.hpp"
#include "stereo_descriptor_vo/messages/stereo_features_view.hpp"

namespace sdvo::ros_conversions::test_stereo_features_view {

using M = FeaturesMessage;

template <class Array>
void addLengths(Refusals<M>& refusals, Array M::*array) {
  refusals.emplace_back([array](M& m) { (m.*array).pop_back(); }, "");
  refusals.emplace_back([array](M& m) { (m.*array).push_back(1); }, "");
  refusals.emplace_back([array](M& m) { (m.*array).clear(); }, "");
}

template <class Field, class Value>
void addValues(Refusals<M>& refusals, Field M::*field, const std::string& name, const std::vector<Value>& values) {
  for (const Value& bad : values) refusals.emplace_back([field, bad](M& m) { m.*field = bad; }, name);
}

Refusals<M> allRefusals() {
  Refusals<M> all = {
      {[](M& m) { m.patch_side = 0xffffffffu; }, "patch_side"},
      {[](M& m) { m.patch_side = 12; }, "patches"},
      {[](M& m) { m.patch_side = 0; }, "patches"},
      {[](M& m) { m.patch_min_spacing = 0.f; }, "patch_min_spacing"},
      {[](M& m) { m.patch_min_spacing = kNaN; }, "patch_min_spacing"},
      {[](M& m) { m.patch_spacing = -1.f; }, "patch_spacing"},
      {[](M& m) { m.bytes_per_row = 0, m.descriptors.clear(); }, "bytes_per_row"},
      {[](M& m) { m.bytes_per_row = 17, m.descriptors.assign(5 * 17, 0); }, "bytes_per_row"},  // has no middle
      {[](M& m) { m.bytes_per_row = 0xffffffffu; }, "bytes_per_row"},
      {[](M& m) { m.bytes_per_row = 0x80000000u; }, "bytes_per_row"},
      // 5 * 3435973837 = 1 modulo 2^32: a product of 32 bits would accept one byte.
      {[](M& m) { m.bytes_per_row = 3435973837u, m.descriptors.assign(1, 0); }, "bytes_per_row"},
      {[](M& m) { m.bytes_per_row -= 2; }, "descriptors"},
      {[](M& m) { m.bytes_per_row += 2; }, "descriptors"},
      {[](M& m) { m.descriptors.resize(m.descriptors.size() - 16); }, "descriptors"},
      {[](M& m) { m.descriptors.resize(m.descriptors.size() + 16); }, "descriptors"},
      {[](M& m) { m.element_type = "float32", m.bytes_per_row = 20, m.descriptors.assign(100, 0); }, "bytes_per_row"},
      {[](M& m) { m.u[2] = 1e9f; }, "array u"},
      {[](M& m) { m.v[2] = -20.f; }, "array v"},
      {[](M& m) { m.disparity[2] = 1e9f; }, "disparity"},
      {[](M& m) { m.size[2] = 1e9f; }, "size"},
      {[](M& m) { m.right_delay = kNaN; }, "right_delay"},
      {[](M& m) { m.right_delay = -2.f; }, "right_delay"}};
  addLengths(all, &M::descriptors);
  addLengths(all, &M::patches);
  const std::pair<std::string, std::vector<float> M::*> floats[] = {
      {"u", &M::u},       {"v", &M::v},         {"disparity", &M::disparity}, {"dv", &M::dv},
      {"size", &M::size}, {"angle", &M::angle}, {"response", &M::response}};
  for (const auto& [name, array] : floats) {
    addLengths(all, array);
    for (const float bad : {kNaN, kInfinity, -kInfinity, 0.f, -1.f})
      if (!std::isfinite(bad) || name == "disparity" || name == "size")
        all.emplace_back([a = array, bad](M& m) { (m.*a)[3] = bad; }, name);
  }
  addValues<std::string, std::string>(all, &M::layout, "layout", {"right", ""});
  addValues<std::string, std::string>(all, &M::element_type, "element_type", {"int8", ""});
  const std::pair<std::string, double M::*> geometry[] = {{"fx", &M::fx}, {"fy", &M::fy}, {"baseline", &M::baseline}};
  for (const auto& [name, field] : geometry) addValues<double, double>(all, field, name, {0.0, -1.0, kNaN, kInfinity});
  addValues<double, double>(all, &M::cx, "cx", {kNaN});
  addValues<double, double>(all, &M::cy, "cy", {kInfinity});
  for (const auto side : {&M::image_width, &M::image_height})
    addValues<std::uint32_t, std::uint32_t>(all, side, "image size", {0u, 65536u, 0xffffffffu});
  return all;
}

TEST(StereoFeaturesViewTest, RefusesEveryMalformedMessage) {
  const Refusals<M> refusals = allRefusals();
  EXPECT_GT(refusals.size(), 80u);
  expectRefusals(
      someMessage(), [](const M& message) { StereoFeaturesView{message}; }, refusals);
  expectRefusals(
      someMessage(), [](const M& message) { fromMessage(message); }, refusals);
}

TEST(StereoFeaturesViewTest, AcceptsAsManyFeaturesAsTheDetectorMayGiveAndNoMore) {
  const auto ofCount = [](std::size_t count) {
    FeaturesMessage message = someMessage();
    for (auto* array :
         {&message.u, &message.v, &message.disparity, &message.dv, &message.size, &message.angle, &message.response})
      array->assign(count, 1.f);
    message.patches.assign(count * message.patch_side * message.patch_side, 0);
    message.descriptors.assign(count * message.bytes_per_row, 0);
    return message;
  };
  FeatureDetectorOptions options;
  OptionList list;
  options.describe(list);
  const auto most = std::find_if(list.options().begin(), list.options().end(),
                                 [](const Option& option) { return option.name == "max_features"; });
  ASSERT_NE(most, list.options().end());
  const auto count = static_cast<std::size_t>(most->range.max);
  EXPECT_NO_THROW(StereoFeaturesView{ofCount(count)});
  EXPECT_THROW(StereoFeaturesView{ofCount(count + 1)}, std::invalid_argument);
}

TEST(StereoFeaturesViewTest, HalvesAreThoseOfTheRowsWithoutACopy) {
  const FeaturesMessage message = someMessage();
  const StereoFeaturesView view(message);
  ASSERT_EQ(view.count(), 5);
  EXPECT_TRUE(view.hasRightHalf());
  const cv::Mat all = view.descriptors(), left = view.leftDescriptors(), right = view.rightDescriptors();
  EXPECT_EQ(all.size(), cv::Size(16, 5));
  EXPECT_EQ(left.size(), cv::Size(8, 5));
  EXPECT_EQ(right.size(), cv::Size(8, 5));
  for (int row = 0; row < 5; ++row) {
    const std::uint8_t* bytes = message.descriptors.data() + 16 * row;
    EXPECT_EQ(all.ptr(row), bytes);
    EXPECT_EQ(left.ptr(row), bytes);
    EXPECT_EQ(right.ptr(row), bytes + 8);
  }
}

TEST(StereoFeaturesViewTest, FloatsAreReadInPlace) {
  const FeaturesMessage message = someMessage(ElementType::kFloat32);
  const StereoFeaturesView view(message);
  const cv::Mat right = view.rightDescriptors();
  ASSERT_EQ(right.type(), CV_32F);
  ASSERT_EQ(right.size(), cv::Size(8, 5));
  EXPECT_EQ(right.ptr(), message.descriptors.data() + 32);
  const cv::Mat truth = someFeatures(ElementType::kFloat32).descriptors;
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 8; ++i) {
      float expected = 0.f;
      std::memcpy(&expected, truth.ptr(row) + 4 * (8 + i), 4);
      EXPECT_EQ(right.at<float>(row, i), expected);
    }
  }
}

TEST(StereoFeaturesViewTest, OneViewHasNoRightHalf) {
  const FeaturesMessage message = someMessage(ElementType::kBits, DescriptorLayout::kLeft);
  const StereoFeaturesView view(message);
  EXPECT_FALSE(view.hasRightHalf());
  EXPECT_TRUE(view.rightDescriptors().empty());
  EXPECT_EQ(view.leftDescriptors().size(), cv::Size(16, 5));
}

TEST(StereoFeaturesViewTest, PointFollowsFromDisparity) {
  FeaturesMessage message = someMessage();
  message.fx = 500.0;
  message.fy = 400.0;
  message.cx = 300.0;
  message.cy = 200.0;
  message.baseline = 0.5;
  message.u[1] = 350.f;
  message.v[1] = 180.f;
  message.disparity[1] = 25.f;
  // Z = 500 * 0.5 / 25 = 10 m; X = 50 px * 10 / 500, Y = -20 px * 10 / 400.
  const cv::Point3d point = StereoFeaturesView(message).point(1);
  EXPECT_NEAR(point.x, 1.0, 1e-12);
  EXPECT_NEAR(point.y, -0.5, 1e-12);
  EXPECT_NEAR(point.z, 10.0, 1e-12);
}

TEST(StereoFeaturesViewTest, NoFeaturesMakeAnEmptyCloud) {
  const sensor_msgs::PointCloud2 cloud =
      toPointCloud(StereoFeaturesView(toMessage(someFeatures().select({}), DepthScaleOptions())));
  EXPECT_EQ(cloud.width * cloud.height, 0u);
  EXPECT_EQ(cloud.fields.size(), 4u);
}

}  // namespace sdvo::ros_conversions::test_stereo_features_view
