#include <gtest/gtest.h>
#include <ros/serialization.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <boost/make_shared.hpp>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "../../src/ros/conversions.hpp"
#include "../../src/ros/features_image.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/ros/stereo_features_view.hpp"

namespace sdvo::ros_conversions {
namespace {

using FeaturesMessage = stereo_descriptor_vo::StereoFeatures;
using synthetic::errorOf;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// ---- StereoFeatures ------------------------------------------------------------------------------------------------

/// Every field has a value of its own, so that a mix-up of two fields shows.
StereoFeatures someFeatures(ElementType type = ElementType::kBits,
                            DescriptorLayout layout = DescriptorLayout::kLeftAndRight) {
  constexpr int kCount = 5;
  StereoFeatures features;
  features.stamp = 1403636579763555584;
  features.camera = {707.0912, 710.25, 601.8873, 183.1104, 0.5371657, 1226, 370};
  features.descriptor = "sift";
  features.layout = layout;
  features.element_type = type;
  for (int i = 0; i < kCount; ++i) {
    const auto x = static_cast<float>(i);
    features.u.push_back(100.1f + 17.3f * x);
    features.v.push_back(50.7f + 3.9f * x);
    features.disparity.push_back(0.37f + 5.01f * x);
    features.dv.push_back(-0.4f + 0.1f * x);
    features.size.push_back(7.3f + x);
    features.angle.push_back(i == 0 ? -1.f : 0.3f * x);
    features.response.push_back(1e-3f * (x + 1.f));
    features.sigma.push_back(0.21f + 0.01f * x);
    features.octave.push_back(static_cast<std::uint8_t>(250 + i));
  }
  cv::Mat rows(kCount, type == ElementType::kFloat32 ? 64 : 16, CV_8U);
  cv::RNG random(7);
  if (type == ElementType::kFloat32) {
    cv::Mat floats(kCount, 16, CV_32F);
    random.fill(floats, cv::RNG::UNIFORM, -300.0, 300.0);
    std::memcpy(rows.data, floats.data, rows.total());
  } else {
    random.fill(rows, cv::RNG::UNIFORM, 0, 256);
  }
  features.descriptors = rows;
  features.report.detected = 1234;
  features.report.mean_intensity[0] = 101.5;
  features.report.mean_intensity[1] = 99.25;
  features.report.sharpness[0] = 3.5;
  features.report.sharpness[1] = 2.75;
  features.report.detect_time = 0.5;
  features.report.stereo_time = 0.25;
  features.report.describe_time = 0.125;
  features.report.status = "only a test";
  return features;
}

FeaturesMessage someMessage(ElementType type = ElementType::kBits,
                            DescriptorLayout layout = DescriptorLayout::kLeftAndRight) {
  FeaturesMessage message = toMessage(someFeatures(type, layout), DepthScaleOptions());
  message.header.stamp.fromNSec(1403636579763555584u);
  message.header.frame_id = "left_optical";
  return message;
}

void expectSame(const StereoFeatures& a, const StereoFeatures& b) {
  EXPECT_EQ(a.stamp, b.stamp);
  EXPECT_TRUE(a.camera == b.camera);
  EXPECT_EQ(a.descriptor, b.descriptor);
  EXPECT_EQ(a.layout, b.layout);
  EXPECT_EQ(a.element_type, b.element_type);
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.v, b.v);
  EXPECT_EQ(a.disparity, b.disparity);
  EXPECT_EQ(a.dv, b.dv);
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.angle, b.angle);
  EXPECT_EQ(a.response, b.response);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.octave, b.octave);
  EXPECT_TRUE(synthetic::equalMats(a.descriptors, b.descriptors));
  EXPECT_EQ(a.report.detected, b.report.detected);
  for (int side = 0; side < 2; ++side) {
    EXPECT_EQ(a.report.mean_intensity[side], b.report.mean_intensity[side]);
    EXPECT_EQ(a.report.sharpness[side], b.report.sharpness[side]);
  }
  EXPECT_EQ(a.report.detect_time, b.report.detect_time);
  EXPECT_EQ(a.report.stereo_time, b.report.stereo_time);
  EXPECT_EQ(a.report.describe_time, b.report.describe_time);
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
      {"size", &M::size}, {"angle", &M::angle}, {"response", &M::response},   {"sigma", &M::sigma}};
  for (const auto& [name, array] : floats) {
    addLengthDamages(damages, name, array);
    for (const float bad : {kNaN, kInfinity, -kInfinity})
      damages.push_back({name + " = " + std::to_string(bad), [a = array, bad](M& m) { (m.*a)[3] = bad; }, name});
  }
  addLengthDamages(damages, "octave", &M::octave);
  addLengthDamages(damages, "descriptors", &M::descriptors);
  for (const auto& [name, array] : {floats[2], floats[4], floats[7]})
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

  const sensor_msgs::PointCloud2 cloud = toPointCloud(message);
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

// ---- CameraInfo ----------------------------------------------------------------------------------------------------

sensor_msgs::CameraInfo cameraInfo(double tx, double f = 700.0) {
  sensor_msgs::CameraInfo info;
  info.width = 1200;
  info.height = 360;
  info.distortion_model = "plumb_bob";
  info.D.assign(5, 0.0);
  info.K = {f, 0.0, 600.0, 0.0, f, 180.0, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {f, 0.0, 600.0, tx, 0.0, f, 180.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

TEST(ToStereoCamera, BaselineIsTheDifferenceOfBothOffsets) {
  const StereoCamera camera = toStereoCamera(cameraInfo(42.0), cameraInfo(-336.0));
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.fy, 700.0);
  EXPECT_DOUBLE_EQ(camera.cx, 600.0);
  EXPECT_DOUBLE_EQ(camera.cy, 180.0);
  EXPECT_NEAR(camera.baseline, 0.54, 1e-12);  // (42 + 336) / 700
  EXPECT_EQ(camera.width, 1200);
  EXPECT_EQ(camera.height, 360);
}

TEST(ToStereoCamera, GeometryComesFromPNotFromK) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) info->K = {900.0, 0.0, 1.0, 0.0, 900.0, 2.0, 0.0, 0.0, 1.0};
  const StereoCamera camera = toStereoCamera(left, right);
  EXPECT_DOUBLE_EQ(camera.fx, 700.0);
  EXPECT_DOUBLE_EQ(camera.cx, 600.0);
}

TEST(ToStereoCamera, BinningAndRegionOfInterest) {
  sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  for (sensor_msgs::CameraInfo* info : {&left, &right}) {
    info->binning_x = info->binning_y = 2;
    info->roi.x_offset = 200;
    info->roi.y_offset = 40;
    info->roi.width = 800;
    info->roi.height = 240;
  }
  const StereoCamera camera = toStereoCamera(left, right);
  EXPECT_DOUBLE_EQ(camera.fx, 350.0);
  EXPECT_DOUBLE_EQ(camera.fy, 350.0);
  EXPECT_DOUBLE_EQ(camera.cx, 200.0);        // (600 - 200) / 2
  EXPECT_DOUBLE_EQ(camera.cy, 70.0);         // (180 - 40) / 2
  EXPECT_NEAR(camera.baseline, 0.5, 1e-12);  // metres do not shrink with the pixels
  EXPECT_EQ(camera.width, 400);
  EXPECT_EQ(camera.height, 120);
}

TEST(ToStereoCamera, RefusesWhatIsNoRectifiedPair) {
  const sensor_msgs::CameraInfo left = cameraInfo(0.0), right = cameraInfo(-350.0);
  ASSERT_NO_THROW(toStereoCamera(left, right));
  const auto refusal = [](const sensor_msgs::CameraInfo& l, const sensor_msgs::CameraInfo& r) {
    EXPECT_THROW(toStereoCamera(l, r), std::invalid_argument);
    return errorOf([&] { toStereoCamera(l, r); });
  };

  sensor_msgs::CameraInfo uncalibrated = right;
  uncalibrated.K.assign(0.0);
  EXPECT_TRUE(contains(refusal(left, uncalibrated), "right camera_info"));
  EXPECT_TRUE(contains(refusal(uncalibrated, right), "left camera_info"));
  sensor_msgs::CameraInfo zero_p = right;
  zero_p.P.assign(0.0);
  EXPECT_TRUE(contains(refusal(left, zero_p), "calibrated"));
  sensor_msgs::CameraInfo no_size = left;
  no_size.width = 0;
  EXPECT_TRUE(contains(refusal(no_size, right), "size"));

  // Swapped: both projection matrices are quoted, so that the user sees which is wrong.
  const std::string swapped = refusal(right, left);
  EXPECT_TRUE(contains(swapped, "baseline")) << swapped;
  EXPECT_TRUE(contains(swapped, "Tx = -350")) << swapped;
  EXPECT_TRUE(contains(swapped, "Tx = 0")) << swapped;
  EXPECT_TRUE(contains(refusal(left, left), "baseline"));

  EXPECT_TRUE(contains(refusal(left, cameraInfo(-350.0, 701.0)), "not rectified"));
  // Rectified without CALIB_ZERO_DISPARITY: depth would be wrong everywhere.
  sensor_msgs::CameraInfo shifted = right;
  shifted.P[2] += 5.0;
  EXPECT_TRUE(contains(refusal(left, shifted), "principal point"));
  shifted = right;
  shifted.P[6] += 5.0;
  EXPECT_TRUE(contains(refusal(left, shifted), "principal point"));
  sensor_msgs::CameraInfo unequal = right;
  unequal.P[5] = 650.0;
  EXPECT_TRUE(contains(refusal(left, unequal), "not rectified"));
  sensor_msgs::CameraInfo not_finite = right;
  not_finite.P[3] = kNaN;
  refusal(left, not_finite);
}

// ---- Images --------------------------------------------------------------------------------------------------------

sensor_msgs::ImagePtr image(const std::string& encoding, int width, int height, const std::vector<std::uint8_t>& data,
                            std::uint32_t step = 0) {
  const auto message = boost::make_shared<sensor_msgs::Image>();
  message->encoding = encoding;
  message->width = static_cast<std::uint32_t>(width);
  message->height = static_cast<std::uint32_t>(height);
  message->data = data;
  message->step = step != 0 ? step : static_cast<std::uint32_t>(data.size()) / message->height;
  return message;
}

TEST(ToGrey, GreyImagesAreNotCopied) {
  for (const char* encoding : {"mono8", "8UC1"}) {
    // Two bytes of padding behind each row.
    const auto message = image(encoding, 3, 2, {1, 2, 3, 99, 99, 4, 5, 6, 99, 99}, 5);
    const cv::Mat grey = toGrey(message);
    ASSERT_EQ(grey.type(), CV_8UC1) << encoding;
    ASSERT_EQ(grey.size(), cv::Size(3, 2)) << encoding;
    EXPECT_EQ(grey.ptr(), message->data.data()) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(1, 0), 4) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(1, 2), 6) << encoding;
  }
}

TEST(ToGrey, SixteenBitsAreScaledToEight) {
  // 65535 -> 255, so 257 levels make one: 100 * 257 = 25700 = 0x6464.
  const auto message = image("mono16", 3, 1, {0x00, 0x00, 0x64, 0x64, 0xff, 0xff});
  const cv::Mat grey = toGrey(message);
  ASSERT_EQ(grey.type(), CV_8UC1);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 1), 100);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 2), 255);
}

TEST(ToGrey, ColoursByLuminance) {
  // Rec. 601: 0.299 red + 0.587 green + 0.114 blue.
  constexpr int kRed = 76, kGreen = 150, kBlue = 29;
  const std::vector<std::uint8_t> three = {255, 0, 0, 0, 255, 0, 0, 0, 255, 40, 40, 40};
  const std::vector<std::uint8_t> four = {255, 0, 0, 7, 0, 255, 0, 7, 0, 0, 255, 7, 40, 40, 40, 7};
  const auto expectPixels = [kGreen](const cv::Mat& grey, int first, int third, const char* encoding) {
    ASSERT_EQ(grey.type(), CV_8UC1) << encoding;
    ASSERT_EQ(grey.size(), cv::Size(4, 1)) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(0, 0), first) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(0, 1), kGreen) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(0, 2), third) << encoding;
    EXPECT_EQ(grey.at<std::uint8_t>(0, 3), 40) << encoding;
  };
  expectPixels(toGrey(image("rgb8", 4, 1, three)), kRed, kBlue, "rgb8");
  expectPixels(toGrey(image("bgr8", 4, 1, three)), kBlue, kRed, "bgr8");
  expectPixels(toGrey(image("rgba8", 4, 1, four)), kRed, kBlue, "rgba8");
  expectPixels(toGrey(image("bgra8", 4, 1, four)), kBlue, kRed, "bgra8");
}

TEST(ToGrey, RefusesOtherEncodingsAndMalformedImages) {
  for (const char* encoding : {"", "bayer_rggb8", "32FC1", "8UC3", "yuv422", "16UC1", "nonsense"}) {
    const auto message = image(encoding, 2, 1, std::vector<std::uint8_t>(8, 0));
    EXPECT_THROW(toGrey(message), std::invalid_argument) << encoding;
    EXPECT_TRUE(contains(errorOf([&] { toGrey(message); }), std::string("'") + encoding + "'")) << encoding;
  }
  for (const char* encoding : {"mono8", "8UC1", "mono16", "rgb8", "bgra8"}) {
    const std::uint32_t step = 8 * 4;
    const auto truncated = image(encoding, 8, 4, std::vector<std::uint8_t>(step * 3), step);
    EXPECT_THROW(toGrey(truncated), std::invalid_argument) << encoding;
    const auto empty = image(encoding, 8, 4, {}, step);
    EXPECT_THROW(toGrey(empty), std::invalid_argument) << encoding;
    const auto narrow = image(encoding, 8, 4, std::vector<std::uint8_t>(4 * 4), 4);
    EXPECT_THROW(toGrey(narrow), std::invalid_argument) << encoding;
  }
}

// ---- Odometry ------------------------------------------------------------------------------------------------------

/// A camera that looks ahead, mounted 1.2 m ahead, 0.3 m left of and 1.6 m above the base.
Eigen::Isometry3d mountedCamera() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  T_base_camera.translation() << 1.2, 0.3, 1.6;
  return T_base_camera;
}

/// Constant turn of the base in its plane over dt: an arc of a circle.
Eigen::Isometry3d arc(double speed, double yaw_rate, double dt) {
  const double angle = yaw_rate * dt, radius = speed / yaw_rate;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() << radius * std::sin(angle), radius * (1.0 - std::cos(angle)), 0.0;
  return T;
}

OdometryResult trackedResult() {
  OdometryResult result;
  result.state = TrackingState::kTracking;
  result.stamp = 1000000000100000007;
  result.has_pose = result.has_motion = true;
  result.dt = 0.1;
  result.pose_covariance = result.motion_covariance = 1e-4 * Matrix6d::Identity();
  return result;
}

using Covariance = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>;

Matrix6d covarianceOf(const boost::array<double, 36>& message) {
  return Covariance(message.data());
}

void expectValidCovariance(const Matrix6d& covariance) {
  EXPECT_TRUE(covariance.allFinite());
  EXPECT_EQ(covariance, covariance.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues().minCoeff(), 0.0);
}

double yawOf(const geometry_msgs::Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

TEST(ToOdometry, ForwardOfTheCameraIsXAndALeftTurnIsPositiveYaw) {
  OdometryResult result = trackedResult();
  Eigen::Isometry3d optical = Eigen::Isometry3d::Identity();
  optical.linear() = mountedCamera().linear();

  result.T_origin_camera = Eigen::Translation3d(0.0, 0.0, 2.5);  // optical z is forward
  geometry_msgs::Pose pose = toOdometry(result, optical, {}).pose.pose;
  EXPECT_NEAR(pose.position.x, 2.5, 1e-12);
  EXPECT_NEAR(pose.position.y, 0.0, 1e-12);
  EXPECT_NEAR(pose.position.z, 0.0, 1e-12);
  EXPECT_NEAR(yawOf(pose.orientation), 0.0, 1e-12);

  result.T_origin_camera = Eigen::Translation3d(-1.0, -2.0, 0.0);  // optical x is right, y is down
  pose = toOdometry(result, optical, {}).pose.pose;
  EXPECT_NEAR(pose.position.y, 1.0, 1e-12);
  EXPECT_NEAR(pose.position.z, 2.0, 1e-12);

  // Turning left moves the view's right side towards the front: about optical y (down) that is negative.
  result.T_origin_camera = Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY());
  EXPECT_NEAR(yawOf(toOdometry(result, optical, {}).pose.pose.orientation), 0.3, 1e-12);
}

TEST(ToOdometry, PoseAndTwistAreThoseOfTheBaseNotOfTheCamera) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  const double dt = 0.1, speed = 8.0, yaw_rate = 0.7;
  OdometryResult result = trackedResult();
  result.dt = dt;
  result.T_previous_current = T_base_camera.inverse() * arc(speed, yaw_rate, dt) * T_base_camera;
  result.T_origin_camera = T_base_camera.inverse() * arc(speed, yaw_rate, 2.0) * T_base_camera;
  const nav_msgs::Odometry odometry = toOdometry(result, T_base_camera, {"world", "robot"});

  EXPECT_EQ(odometry.header.frame_id, "world");
  EXPECT_EQ(odometry.child_frame_id, "robot");
  EXPECT_EQ(odometry.header.stamp.toNSec(), 1000000000100000007u);
  // After 2 s on the circle.
  EXPECT_NEAR(odometry.pose.pose.position.x, speed / yaw_rate * std::sin(1.4), 1e-9);
  EXPECT_NEAR(odometry.pose.pose.position.y, speed / yaw_rate * (1.0 - std::cos(1.4)), 1e-9);
  EXPECT_NEAR(odometry.pose.pose.position.z, 0.0, 1e-9);
  EXPECT_NEAR(yawOf(odometry.pose.pose.orientation), 1.4, 1e-9);
  // In the base's own frame the velocity of a constant turn is constant.
  const geometry_msgs::Twist& twist = odometry.twist.twist;
  EXPECT_NEAR(twist.linear.x, speed, 1e-9);
  EXPECT_NEAR(twist.linear.y, 0.0, 1e-9);
  EXPECT_NEAR(twist.linear.z, 0.0, 1e-9);
  EXPECT_NEAR(twist.angular.x, 0.0, 1e-9);
  EXPECT_NEAR(twist.angular.y, 0.0, 1e-9);
  EXPECT_NEAR(twist.angular.z, yaw_rate, 1e-9);
}

TEST(ToOdometry, QuaternionIsUnitAlsoForADriftedRotation) {
  OdometryResult result = trackedResult();
  result.T_origin_camera = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1.0, 2.0, -1.0).normalized());
  result.T_origin_camera.linear() *= 1.0 + 1e-5;
  const geometry_msgs::Quaternion q = toOdometry(result, mountedCamera(), {}).pose.pose.orientation;
  EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-12);
}

TEST(ToOdometry, TheFirstPairHasNoTwistAndSaysSo) {
  OdometryResult result = trackedResult();
  result.has_motion = false;
  result.dt = 0.0;
  result.pose_covariance.setZero();
  const nav_msgs::Odometry odometry = toOdometry(result, mountedCamera(), {});
  EXPECT_EQ(odometry.twist.twist.linear.x, 0.0);
  EXPECT_EQ(odometry.twist.twist.angular.z, 0.0);
  const Matrix6d twist = covarianceOf(odometry.twist.covariance);
  expectValidCovariance(twist);
  EXPECT_GE(twist.diagonal().minCoeff(), 1e5);  // nothing that moves on the ground is that fast
  const Matrix6d pose = covarianceOf(odometry.pose.covariance);
  expectValidCovariance(pose);  // the initial pose is exact by definition, yet filters invert this matrix
  EXPECT_LT(pose.diagonal().maxCoeff(), 1e-6);
}

/// A covariance without any symmetry that would hide a mix-up of axes.
Matrix6d someCovariance() {
  Matrix6d root;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = uniform(random);
  Vector6d scale;
  scale << 2e-3, 1e-3, 4e-3, 1e-3, 5e-4, 2e-3;
  return scale.asDiagonal() * (root * root.transpose() + 0.1 * Matrix6d::Identity()) * scale.asDiagonal();
}

/// Sample covariance of what `measure` makes of small random camera perturbations of covariance `covariance`.
Matrix6d sampledCovariance(const Matrix6d& covariance,
                           const std::function<Vector6d(const Eigen::Isometry3d& perturbation)>& measure) {
  const Matrix6d root = covariance.llt().matrixL();
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  constexpr int kSamples = 100000;
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = normal(random);
    xi = root * xi;
    // To first order, all that counts at a few milliradian.
    Eigen::Isometry3d perturbation = Eigen::Isometry3d::Identity();
    perturbation.translation() = xi.head<3>();
    perturbation.linear() = Eigen::AngleAxisd(xi.tail<3>().norm(), xi.tail<3>().normalized()).toRotationMatrix();
    const Vector6d y = measure(perturbation);
    sum += y * y.transpose();
  }
  return sum / kSamples;
}

Eigen::Vector3d rotationVector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

/// Equal within the sampling error; correlations are compared in units of the standard deviations.
void expectSameCovariance(const Matrix6d& actual, const Matrix6d& expected) {
  const Vector6d sigma = expected.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(actual(i, j) / (sigma[i] * sigma[j]), expected(i, j) / (sigma[i] * sigma[j]), 0.03)
          << "element " << i << "," << j;
}

TEST(ToOdometry, PoseCovarianceIsThatOfThePublishedPose) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  OdometryResult result = trackedResult();
  result.T_origin_camera =
      Eigen::Translation3d(3.0, -1.0, 20.0) * Eigen::AngleAxisd(-1.1, Eigen::Vector3d(0.2, 1.0, -0.1).normalized());
  result.pose_covariance = someCovariance();
  const Matrix6d covariance = covarianceOf(toOdometry(result, T_base_camera, {}).pose.covariance);
  expectValidCovariance(covariance);

  // ROS: position in the axes of odom, rotation about the fixed axes of odom.
  const Eigen::Isometry3d mean = T_base_camera * result.T_origin_camera * T_base_camera.inverse();
  expectSameCovariance(
      covariance, sampledCovariance(result.pose_covariance, [&](const Eigen::Isometry3d& xi) {
        const Eigen::Isometry3d sample = T_base_camera * result.T_origin_camera * xi * T_base_camera.inverse();
        Vector6d y;
        y << sample.translation() - mean.translation(), rotationVector(sample.linear() * mean.linear().transpose());
        return y;
      }));
}

TEST(ToOdometry, TwistCovarianceIsThatOfThePublishedTwist) {
  const Eigen::Isometry3d T_base_camera = mountedCamera();
  OdometryResult result = trackedResult();
  result.dt = 0.05;
  result.motion_covariance = someCovariance();
  const Matrix6d covariance = covarianceOf(toOdometry(result, T_base_camera, {}).twist.covariance);
  expectValidCovariance(covariance);
  // At rest the twist is the perturbation itself over dt, seen from the base.
  expectSameCovariance(covariance, sampledCovariance(result.motion_covariance, [&](const Eigen::Isometry3d& xi) {
                         const Eigen::Isometry3d sample = T_base_camera * xi * T_base_camera.inverse();
                         Vector6d y;
                         y << sample.translation() / result.dt, rotationVector(sample.linear()) / result.dt;
                         return y;
                       }));
}

TEST(CleanFrameId, LosesTheLeadingSlash) {
  EXPECT_EQ(cleanFrameId("/odom"), "odom");
  EXPECT_EQ(cleanFrameId("robot/odom"), "robot/odom");
  EXPECT_EQ(cleanFrameId(""), "");
}

Eigen::Isometry3d poseOf(const geometry_msgs::TransformStamped& message) {
  const auto& t = message.transform.translation;
  const auto& q = message.transform.rotation;
  return Eigen::Translation3d(t.x, t.y, t.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z);
}

TEST(ToTransform, EqualsTheOdometryOrItsInverse) {
  OdometryResult result = trackedResult();
  result.T_origin_camera = Eigen::Translation3d(3.0, -1.0, 20.0) * Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitY());
  const nav_msgs::Odometry odometry = toOdometry(result, mountedCamera(), {"world", "robot"});
  const geometry_msgs::TransformStamped direct = toTransform(odometry, false);
  EXPECT_EQ(direct.header.frame_id, "world");
  EXPECT_EQ(direct.child_frame_id, "robot");
  EXPECT_EQ(direct.header.stamp, odometry.header.stamp);
  EXPECT_NEAR(direct.transform.translation.x, odometry.pose.pose.position.x, 1e-12);
  EXPECT_NEAR(direct.transform.translation.y, odometry.pose.pose.position.y, 1e-12);
  EXPECT_NEAR(direct.transform.rotation.z, odometry.pose.pose.orientation.z, 1e-12);
  EXPECT_NEAR(direct.transform.rotation.w, odometry.pose.pose.orientation.w, 1e-12);

  const geometry_msgs::TransformStamped inverse = toTransform(odometry, true);
  EXPECT_EQ(inverse.header.frame_id, "robot");
  EXPECT_EQ(inverse.child_frame_id, "world");
  EXPECT_EQ(inverse.header.stamp, odometry.header.stamp);
  EXPECT_TRUE((poseOf(direct) * poseOf(inverse)).isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

// ---- VoInfo --------------------------------------------------------------------------------------------------------

TEST(ToInfo, TellsResultAndImageSide) {
  OdometryResult result = trackedResult();
  result.state = TrackingState::kDegraded;
  result.reason = "motion predicted";
  result.epoch = 3;
  result.features = 900;
  result.matches = 400;
  result.inliers = 300;
  result.coverage = 0.75;
  result.rms = 0.5;
  result.match_time = 0.25;
  result.motion_time = 0.125;
  result.distance = 42.5;
  result.keyframe_id = 17;
  result.disparity_offset = -0.25;
  result.disparity_offset_sigma = 0.05;
  result.disparity_bend = 1.5;
  result.right_rotation << 0.001, -0.002, 0.003;
  FeaturesMessage features = someMessage();
  features.dropped_pairs = 6;
  const stereo_descriptor_vo::VoInfo info = toInfo(result, features);
  EXPECT_EQ(info.state, "DEGRADED");
  EXPECT_EQ(info.reason, "motion predicted");
  EXPECT_EQ(info.epoch, 3u);
  EXPECT_EQ(info.detected, 1234u);
  EXPECT_EQ(info.features, 900u);
  EXPECT_EQ(info.matches, 400u);
  EXPECT_EQ(info.inliers, 300u);
  EXPECT_EQ(info.inlier_ratio, 0.75f);
  EXPECT_EQ(info.coverage, 0.75f);
  EXPECT_EQ(info.rms_reprojection_error, 0.5f);
  EXPECT_EQ(info.detect_time, 0.5f);
  EXPECT_EQ(info.stereo_time, 0.25f);
  EXPECT_EQ(info.describe_time, 0.125f);
  EXPECT_EQ(info.match_time, 0.25f);
  EXPECT_EQ(info.motion_time, 0.125f);
  EXPECT_EQ(info.dropped_pairs, 6u);
  EXPECT_EQ(info.distance, 42.5);
  EXPECT_EQ(info.keyframe_id, 17u);
  EXPECT_FLOAT_EQ(info.disparity_offset, -0.25f);
  EXPECT_FLOAT_EQ(info.disparity_offset_sigma, 0.05f);
  EXPECT_FLOAT_EQ(info.disparity_bend, 1.5f);
  EXPECT_FLOAT_EQ(info.right_rotation[1], -0.002f);

  result.matches = result.inliers = 0;
  EXPECT_EQ(toInfo(result, features).inlier_ratio, 0.f);
}

TEST(ToInfo, IsUnderAKilobyteWithTheLongestReasons) {
  OdometryResult result = trackedResult();
  result.reason = std::string(400, 'x');
  stereo_descriptor_vo::VoInfo info = toInfo(result, someMessage());
  info.header.frame_id = "robot/odom";
  EXPECT_LT(ros::serialization::serializationLength(info), 1000u);
}

TEST(ToFlow, LeadsFromThePreviousPositionToThePresentOne) {
  OdometryResult result = trackedResult();
  const StereoFeatures features = someFeatures();
  result.flow = {{10.f, 20.f, 3, true}, {30.f, 40.f, 0, false}};
  const stereo_descriptor_vo::FeatureFlow flow = toFlow(result, features);
  EXPECT_EQ(flow.u_reference, (std::vector<float>{10.f, 30.f}));
  EXPECT_EQ(flow.v_reference, (std::vector<float>{20.f, 40.f}));
  EXPECT_EQ(flow.u, (std::vector<float>{features.u[3], features.u[0]}));
  EXPECT_EQ(flow.v, (std::vector<float>{features.v[3], features.v[0]}));
  ASSERT_EQ(flow.inlier.size(), 2u);
  EXPECT_TRUE(flow.inlier[0]);
  EXPECT_FALSE(flow.inlier[1]);
}

/// Pixels that are not grey any more.
int colouredPixels(const cv::Mat& picture) {
  int count = 0;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const auto& pixel = picture.at<cv::Vec3b>(y, x);
      count += pixel[0] != pixel[1] || pixel[1] != pixel[2] ? 1 : 0;
    }
  return count;
}

TEST(DrawFeatures, DrawsCirclesOfTheDepthDerivedSizeInBothViews) {
  constexpr float kSize = 40.f;
  stereo_descriptor_vo::StereoFeatures message = someMessage();
  for (float& size : message.size) size = 1.f;
  message.u[0] = 200.f;
  message.v[0] = 200.f;
  message.disparity[0] = 50.f;
  message.dv[0] = 0.f;
  message.size[0] = kSize;
  const cv::Mat grey(370, 1226, CV_8UC1, cv::Scalar(90));
  const cv::Mat picture = drawFeatures(grey, grey, message, {});
  ASSERT_EQ(picture.size(), cv::Size(1226, 740));
  const auto isColoured = [&](int x, int y) { return colouredPixels(picture(cv::Rect(x, y, 1, 1))) == 1; };
  EXPECT_TRUE(isColoured(200 + 20, 200));
  EXPECT_TRUE(isColoured(200, 200 - 20));
  EXPECT_FALSE(isColoured(200 + 16, 200));
  EXPECT_TRUE(isColoured(150 + 20, 370 + 200));
  EXPECT_FALSE(isColoured(200 + 20, 370 + 200));
}

TEST(DrawFeatures, SurvivesFlowOfUnequalLengths) {
  stereo_descriptor_vo::FeatureFlow flow;
  flow.u = {1.f, 2.f};
  flow.v = {1.f};
  const cv::Mat grey(370, 1226, CV_8UC1, cv::Scalar(90));
  EXPECT_NO_THROW(drawFeatures(grey, grey, someMessage(), flow));
}

}  // namespace
}  // namespace sdvo::ros_conversions
