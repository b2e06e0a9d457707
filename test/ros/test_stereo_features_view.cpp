#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "message_samples.hpp"
#include "stereo_descriptor_vo/front_end/feature_detector.hpp"
#include "stereo_descriptor_vo/ros/stereo_features_view.hpp"

namespace sdvo::ros_conversions {
namespace test_stereo_features_view {

/// A change to a message that makes it invalid, and what the refusal must speak of.
struct Damage {
  std::string name;
  std::function<void(FeaturesMessage&)> apply;
  std::string said;
};

template <class Array>
void addLengthDamages(std::vector<Damage>& damages, const std::string& name, Array FeaturesMessage::*array) {
  damages.push_back({name + " shorter", [array](FeaturesMessage& m) { (m.*array).pop_back(); }, ""});
  damages.push_back({name + " longer", [array](FeaturesMessage& m) { (m.*array).push_back(1); }, ""});
  damages.push_back({name + " empty", [array](FeaturesMessage& m) { (m.*array).clear(); }, ""});
}

std::vector<Damage> allDamages() {
  using M = FeaturesMessage;
  std::vector<Damage> damages;
  const std::pair<std::string, std::vector<float> M::*> floats[] = {
      {"u", &M::u},       {"v", &M::v},         {"disparity", &M::disparity}, {"dv", &M::dv},
      {"size", &M::size}, {"angle", &M::angle}, {"response", &M::response}};
  for (const auto& [name, array] : floats) {
    addLengthDamages(damages, name, array);
    for (const float bad : {kNaN, kInfinity, -kInfinity})
      damages.push_back({name + " = " + std::to_string(bad), [a = array, bad](M& m) { (m.*a)[3] = bad; }, name});
  }
  addLengthDamages(damages, "descriptors", &M::descriptors);
  addLengthDamages(damages, "patches", &M::patches);
  damages.push_back({"patch_side too large", [](M& m) { m.patch_side = 0xffffffffu; }, "patch_side"});
  damages.push_back({"patch_side of another size", [](M& m) { m.patch_side = 12; }, "patches"});
  damages.push_back({"patch_side = 0", [](M& m) { m.patch_side = 0; }, "patches"});
  damages.push_back({"patch_min_spacing = 0", [](M& m) { m.patch_min_spacing = 0.f; }, "patch_min_spacing"});
  damages.push_back({"patch_min_spacing = NaN", [](M& m) { m.patch_min_spacing = kNaN; }, "patch_min_spacing"});
  damages.push_back({"patch_spacing = -1", [](M& m) { m.patch_spacing = -1.f; }, "patch_spacing"});
  for (const auto& [name, array] : {floats[2], floats[4]})
    for (const float bad : {0.f, -1.f})
      damages.push_back({name + " = " + std::to_string(bad), [a = array, bad](M& m) { (m.*a)[0] = bad; }, name});

  const auto bytes_per_row = [&](std::uint32_t value) {
    damages.push_back({"bytes_per_row = " + std::to_string(value),
                       [value](M& m) {
                         m.bytes_per_row = value;
                         if (value < 1000) m.descriptors.assign(m.u.size() * value, 0);
                       },
                       "bytes_per_row"});
  };
  bytes_per_row(0);
  bytes_per_row(17);  // has no middle
  bytes_per_row(0xffffffffu);
  bytes_per_row(0x80000000u);
  // 5 * 3435973837 = 1 modulo 2^32: a product of 32 bits would accept one byte.
  damages.push_back({"bytes_per_row overflows", [](M& m) { m.bytes_per_row = 3435973837u, m.descriptors.assign(1, 0); },
                     "bytes_per_row"});
  damages.push_back({"bytes_per_row too small", [](M& m) { m.bytes_per_row -= 2; }, "descriptors"});
  damages.push_back({"bytes_per_row too large", [](M& m) { m.bytes_per_row += 2; }, "descriptors"});
  damages.push_back({"one row missing", [](M& m) { m.descriptors.resize(m.descriptors.size() - 16); }, "descriptors"});
  damages.push_back({"one row too many", [](M& m) { m.descriptors.resize(m.descriptors.size() + 16); }, "descriptors"});
  damages.push_back({"half floats",
                     [](M& m) { m.element_type = "float32", m.bytes_per_row = 20, m.descriptors.assign(100, 0); },
                     "bytes_per_row"});

  damages.push_back({"layout right", [](M& m) { m.layout = "right"; }, "layout"});
  damages.push_back({"layout empty", [](M& m) { m.layout.clear(); }, "layout"});
  damages.push_back({"element_type int8", [](M& m) { m.element_type = "int8"; }, "element_type"});
  damages.push_back({"element_type empty", [](M& m) { m.element_type.clear(); }, "element_type"});

  const std::pair<std::string, double M::*> geometry[] = {{"fx", &M::fx}, {"fy", &M::fy}, {"baseline", &M::baseline}};
  for (const auto& [name, field] : geometry)
    for (const double bad : {0.0, -1.0, static_cast<double>(kNaN), static_cast<double>(kInfinity)})
      damages.push_back({name + " = " + std::to_string(bad), [f = field, bad](M& m) { m.*f = bad; }, name});
  damages.push_back({"cx nan", [](M& m) { m.cx = kNaN; }, "cx"});
  damages.push_back({"cy inf", [](M& m) { m.cy = kInfinity; }, "cy"});
  damages.push_back({"width 0", [](M& m) { m.image_width = 0; }, "image size"});
  damages.push_back({"height 0", [](M& m) { m.image_height = 0; }, "image size"});
  damages.push_back({"width huge", [](M& m) { m.image_width = 0xffffffffu; }, "image size"});
  damages.push_back({"width large", [](M& m) { m.image_width = 65536; }, "image size"});
  damages.push_back({"height large", [](M& m) { m.image_height = 65536; }, "image size"});
  damages.push_back({"u beyond the image", [](M& m) { m.u[2] = 1e9f; }, "u or v"});
  damages.push_back({"v before the image", [](M& m) { m.v[2] = -20.f; }, "u or v"});
  damages.push_back({"disparity larger than the image", [](M& m) { m.disparity[2] = 1e9f; }, "disparity"});
  damages.push_back({"size larger than the image", [](M& m) { m.size[2] = 1e9f; }, "size"});
  damages.push_back({"delay nan", [](M& m) { m.right_delay = kNaN; }, "right_delay"});
  damages.push_back({"delay long", [](M& m) { m.right_delay = -2.f; }, "right_delay"});
  damages.push_back({"height huge", [](M& m) { m.image_height = 0xffffffffu; }, "image size"});
  return damages;
}

TEST(StereoFeaturesViewTest, RefusesEveryMalformedMessage) {
  const FeaturesMessage good = someMessage();
  ASSERT_NO_THROW(StereoFeaturesView{good});
  const std::vector<Damage> damages = allDamages();
  EXPECT_GT(damages.size(), 80u);
  for (const Damage& damage : damages) {
    FeaturesMessage message = good;
    damage.apply(message);
    try {
      const StereoFeaturesView view(message);
      ADD_FAILURE() << damage.name << ": accepted";
    } catch (const std::invalid_argument& e) {
      EXPECT_TRUE(contains(e.what(), damage.said)) << damage.name << ": " << e.what();
    }
    EXPECT_THROW(fromMessage(message), std::invalid_argument) << damage.name;
  }
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

  const sensor_msgs::PointCloud2 cloud = toPointCloud(StereoFeaturesView(message));
  EXPECT_EQ(cloud.header.frame_id, "left_optical");
  EXPECT_EQ(cloud.header.stamp, message.header.stamp);
  ASSERT_EQ(cloud.width * cloud.height, 5u);
  sensor_msgs::PointCloud2ConstIterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z"), d(cloud, "disparity");
  ++x, ++y, ++z, ++d;
  EXPECT_FLOAT_EQ(*x, 1.f);
  EXPECT_FLOAT_EQ(*y, -0.5f);
  EXPECT_FLOAT_EQ(*z, 10.f);
  EXPECT_EQ(*d, 25.f);
}

TEST(StereoFeaturesViewTest, NoFeaturesMakeAnEmptyCloud) {
  const sensor_msgs::PointCloud2 cloud =
      toPointCloud(StereoFeaturesView(toMessage(someFeatures().select({}), DepthScaleOptions())));
  EXPECT_EQ(cloud.width * cloud.height, 0u);
  EXPECT_EQ(cloud.fields.size(), 4u);
}

}  // namespace test_stereo_features_view
}  // namespace sdvo::ros_conversions
