#include <gtest/gtest.h>
#include <ros/serialization.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_features_message {

void expectSame(const StereoFeatures& a, const StereoFeatures& b) {
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_TRUE(a.camera == b.camera);
  EXPECT_EQ(a.right_delay, b.right_delay);
  EXPECT_EQ(a.descriptor, b.descriptor);
  EXPECT_EQ(a.layout, b.layout);
  EXPECT_EQ(a.element_type, b.element_type);
  synthetic::expectEqual(a, b);
  EXPECT_TRUE(a.patch_layout == b.patch_layout);
  EXPECT_TRUE(synthetic::equalMats(a.patches, b.patches));
  EXPECT_EQ(a.report.detected, b.report.detected);
  for (int side = 0; side < 2; ++side) {
    EXPECT_EQ(a.report.mean_intensity[side], b.report.mean_intensity[side]);
    EXPECT_EQ(a.report.sharpness[side], b.report.sharpness[side]);
  }
  EXPECT_EQ(a.report.noise, b.report.noise);
  EXPECT_EQ(a.report.detect_time, b.report.detect_time);
  EXPECT_EQ(a.report.stereo_time, b.report.stereo_time);
  EXPECT_EQ(a.report.describe_time, b.report.describe_time);
  EXPECT_EQ(a.report.refused, b.report.refused);
  EXPECT_EQ(a.report.status, b.report.status);
}

TEST(FeaturesMessageTest, RoundTripIsExactAlsoOverTheWire) {
  for (const ElementType type : {ElementType::kBits, ElementType::kUint8, ElementType::kFloat32})
    for (const DescriptorLayout layout : {DescriptorLayout::kLeft, DescriptorLayout::kLeftAndRight}) {
      SCOPED_TRACE(nameOf(layout) + " " + std::to_string(static_cast<int>(type)));
      const FeaturesMessage sent = someMessage(type, layout);
      std::vector<std::uint8_t> buffer(ros::serialization::serializationLength(sent));
      ros::serialization::OStream out(buffer.data(), static_cast<std::uint32_t>(buffer.size()));
      ros::serialization::serialize(out, sent);
      ros::serialization::IStream in(buffer.data(), static_cast<std::uint32_t>(buffer.size()));
      FeaturesMessage received;
      ros::serialization::deserialize(in, received);
      expectSame(fromMessage(received), someFeatures(type, layout));
    }
}

TEST(FeaturesMessageTest, TheCloudHasThePointsAndTheirDisparities) {
  const FeaturesMessage message = someMessage();
  const StereoFeatures features = someFeatures();
  const sensor_msgs::PointCloud2 cloud = toPointCloud(StereoFeaturesView(message));
  EXPECT_EQ(cloud.header.stamp, message.header.stamp);
  EXPECT_EQ(cloud.header.frame_id, "left_optical");
  ASSERT_EQ(cloud.height * cloud.width, static_cast<std::uint32_t>(features.count()));
  sensor_msgs::PointCloud2ConstIterator<float> field(cloud, "x");
  for (int i = 0; i < features.count(); ++i, ++field) {
    EXPECT_LT((Eigen::Vector3f(field[0], field[1], field[2]) - features.point(i).cast<float>()).norm(), 1e-5f) << i;
    EXPECT_EQ(field[3], features.disparity[static_cast<std::size_t>(i)]) << i;
  }
}

TEST(FeaturesMessageTest, NamesItsContents) {
  const FeaturesMessage bits = someMessage();
  EXPECT_EQ(bits.element_type, "bits");
  EXPECT_EQ(bits.bytes_per_row, 16u);
  EXPECT_EQ(bits.descriptors.size(), 5u * 16u);
  const FeaturesMessage floats = someMessage(ElementType::kFloat32);
  EXPECT_EQ(floats.element_type, "float32");
  EXPECT_EQ(floats.bytes_per_row, 64u);
  EXPECT_EQ(someMessage(ElementType::kUint8).element_type, "uint8");
}

TEST(FeaturesMessageTest, SizeCurveWithAndWithoutNormalisation) {
  DepthScaleOptions curve;
  curve.slope = 0.5;
  curve.exponent = 1.25;
  curve.offset = -2.0;
  curve.min_size = 8.0;
  curve.max_size = 64.0;
  curve.constant_size = 11.0;
  FeaturesMessage message = toMessage(someFeatures(), curve);
  EXPECT_TRUE(message.scale_normalised);
  EXPECT_EQ(message.size_slope, 0.5f);
  EXPECT_EQ(message.size_exponent, 1.25f);
  EXPECT_EQ(message.size_offset, -2.f);
  EXPECT_EQ(message.size_min, 8.f);
  EXPECT_EQ(message.size_max, 64.f);
  curve.scale_normalisation = false;
  message = toMessage(someFeatures(), curve);
  EXPECT_FALSE(message.scale_normalised);
  EXPECT_EQ(message.size_min, 11.f);
  EXPECT_EQ(message.size_max, 11.f);
}

TEST(FeaturesMessageTest, RowsOfALargerMatrixAreSentAlone) {
  StereoFeatures features = someFeatures();
  cv::Mat larger(9, 16, CV_8U, cv::Scalar(0xee));
  features.descriptors.copyTo(larger.rowRange(2, 7));
  features.descriptors = larger.rowRange(2, 7);
  expectSame(fromMessage([&] {
               FeaturesMessage message = toMessage(features, DepthScaleOptions());
               message.header.stamp.fromNSec(1403636579763555584u);
               return message;
             }()),
             someFeatures());
}

TEST(FeaturesMessageTest, NoFeaturesAreAValidMessage) {
  const StereoFeatures none = synthetic::noFeatures(synthetic::camera());
  const StereoFeatures received = fromMessage(toMessage(none, DepthScaleOptions()));
  EXPECT_EQ(received.count(), 0);
  EXPECT_NO_THROW(received.check());
}

TEST(FeaturesMessageTest, APairThatTheRigMonitorRefusedIsKnownAsOne) {
  StereoFeatures refused = synthetic::noFeatures(synthetic::camera());
  refused.report.refused = true;
  refused.report.status = "right image 4 px too low: not rectified?";
  const StereoFeatures received = fromMessage(toMessage(refused, DepthScaleOptions()));
  EXPECT_TRUE(received.report.refused);
  EXPECT_EQ(received.report.status, refused.report.status);
}

}  // namespace sdvo::ros_conversions::test_features_message
