#include <gtest/gtest.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions {
namespace test_grey_image {

using synthetic::errorOf;

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

TEST(ToGrey, SixteenBitsOfEitherOrderOfBytes) {
  const auto message = image("mono16", 2, 1, {0x64, 0x65, 0xff, 0x00});
  EXPECT_EQ(toGrey(message).at<std::uint8_t>(0, 0), 0x65);  // 0x6564 / 257 = 101
  EXPECT_EQ(toGrey(message).at<std::uint8_t>(0, 1), 1);
  message->is_bigendian = 1;
  EXPECT_EQ(toGrey(message).at<std::uint8_t>(0, 0), 0x64);
  EXPECT_EQ(toGrey(message).at<std::uint8_t>(0, 1), 0xfe);
}

TEST(ToGrey, CamerasOfFewerBitsFillTheRange) {
  // 1023 and 341 of 10 bits.
  const auto message = image("mono16", 2, 1, {0xff, 0x03, 0x55, 0x01});
  const cv::Mat grey = toGrey(message, 10);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 0), 255);
  EXPECT_EQ(grey.at<std::uint8_t>(0, 1), 85);
  EXPECT_EQ(toGrey(message, 12).at<std::uint8_t>(0, 0), 64);
}

TEST(BitDepth, IsThatOfTheBrightestPixel) {
  const auto depthOf = [](int value) {
    const auto low = static_cast<std::uint8_t>(value & 0xff), high = static_cast<std::uint8_t>(value >> 8);
    return bitDepth(*image("mono16", 2, 1, {0, 0, low, high}));
  };
  EXPECT_EQ(depthOf(0), 8);
  EXPECT_EQ(depthOf(255), 8);
  EXPECT_EQ(depthOf(256), 10);
  EXPECT_EQ(depthOf(1023), 10);
  EXPECT_EQ(depthOf(1024), 12);
  EXPECT_EQ(depthOf(4095), 12);
  EXPECT_EQ(depthOf(16383), 14);
  EXPECT_EQ(depthOf(65535), 16);
  EXPECT_EQ(bitDepth(*image("mono8", 2, 1, {255, 255})), 8);
  EXPECT_THROW(bitDepth(*image("mono16", 2, 2, {0, 0, 0, 0})), std::invalid_argument);
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

}  // namespace test_grey_image
}  // namespace sdvo::ros_conversions
