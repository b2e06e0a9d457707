#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "message_samples.hpp"

namespace sdvo::ros_conversions::test_grey_image {

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

TEST(ToGrey, SixteenBitsOfEitherOrderOfBytesAreScaledToEight) {
  struct Case {
    std::vector<std::uint8_t> data;
    GreyRange range;
    bool is_bigendian;
    std::vector<int> grey;
  };
  const GreyRange all{0.0, 65535.0};
  for (const Case& c : {
           // 65535 -> 255, so 257 levels make one: 100 * 257 = 25700 = 0x6464.
           Case{{0x00, 0x00, 0x64, 0x64, 0xff, 0xff}, all, false, {0, 100, 255}},
           Case{{0x64, 0x65, 0xff, 0x00}, all, false, {0x65, 1}},
           Case{{0x64, 0x65, 0xff, 0x00}, all, true, {0x64, 0xfe}},
           // 1023 and 341 of 10 bits fill the range.
           Case{{0xff, 0x03, 0x55, 0x01}, {0.0, 1023.0}, false, {255, 85}},
           Case{{0xff, 0x03, 0x55, 0x01}, {0.0, 4095.0}, false, {64, 21}},
           Case{{0xff, 0x03, 0x55, 0x01}, {341.0, 1023.0}, false, {255, 0}},
       }) {
    const auto message = image("mono16", static_cast<int>(c.grey.size()), 1, c.data);
    message->is_bigendian = c.is_bigendian;
    const cv::Mat grey = toGrey(message, c.range);
    ASSERT_EQ(grey.type(), CV_8UC1);
    EXPECT_EQ(std::vector<int>(grey.begin<std::uint8_t>(), grey.end<std::uint8_t>()), c.grey) << c.range.white;
  }
}

TEST(ToGrey, ACompressedImageThatCannotBeDecodedIsNamedByItsFormat) {
  expectError([] { toGrey(image(kUndecoded + "16UC1; compressedDepth png", 1, 1, {0})); }, {"compressedDepth", "JPEG"});
}

/// A scene whose counts rise evenly from `dark` to `bright` across the image.
sensor_msgs::ImagePtr ramp(int dark, int bright) {
  constexpr int kWidth = 200, kHeight = 120;
  std::vector<std::uint8_t> data;
  for (int row = 0; row < kHeight; ++row)
    for (int column = 0; column < kWidth; ++column) {
      const int count = dark + (bright - dark) * column / (kWidth - 1);
      data.push_back(static_cast<std::uint8_t>(count & 0xff));
      data.push_back(static_cast<std::uint8_t>(count >> 8));
    }
  return image("mono16", kWidth, kHeight, data);
}

/// A lamp of the brightest count on a square of so many pixels.
sensor_msgs::ImagePtr withLamp(const sensor_msgs::ImagePtr& message, std::uint32_t side) {
  for (std::uint32_t row = 10; row < 10 + side; ++row)
    for (std::uint32_t byte = 20; byte < 20 + 2 * side; ++byte) message->data[row * message->step + byte] = 0xff;
  return message;
}

void expectFits(const GreyRange& range, int dark, int bright) {
  const double spread = bright - dark;
  EXPECT_LE(range.black, dark);
  EXPECT_GE(range.white, bright);
  EXPECT_GE(spread / (range.white - range.black), 0.5) << range.black << " to " << range.white;
}

TEST(GreyRangeTracker, AnyDepthAndOffsetFillsTheGreyLevels) {
  for (const auto& [dark, bright] : std::vector<std::pair<int, int>>{
           {0, 1023}, {30, 3500}, {100, 60000}, {7800, 8310}, {20000, 20100}, {64000, 65535}}) {
    GreyRangeTracker tracker;
    EXPECT_TRUE(tracker.add(*ramp(dark, bright), *ramp(dark, bright)));
    expectFits(tracker.range(), dark, bright);
  }
}

TEST(GreyRangeTracker, ALampOrADeadPixelChangesNothing) {
  GreyRangeTracker tracker, from_the_start;
  EXPECT_TRUE(from_the_start.add(*withLamp(ramp(0, 1000), 20), *ramp(0, 1000)));
  expectFits(from_the_start.range(), 0, 1000);
  tracker.add(*ramp(0, 1000), *ramp(0, 1000));
  for (const std::uint32_t side : {1u, 1u, 4u, 20u, 20u, 20u, 20u, 20u, 20u})
    EXPECT_FALSE(tracker.add(*withLamp(ramp(0, 1000), side), *withLamp(ramp(0, 1000), side))) << side;
}

TEST(GreyRangeTracker, TwoDamagedPairsChangeNothing) {
  GreyRangeTracker tracker;
  for (int i = 0; i < 5; ++i) tracker.add(*ramp(0, 1000), *ramp(0, 1000));
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(tracker.add(*ramp(65535, 65535), *ramp(65535, 65535)));
  EXPECT_FALSE(tracker.add(*ramp(0, 1000), *ramp(0, 1000)));
}

TEST(GreyRangeTracker, StaysWhileTheCountsFitAndFollowsThemUpAndDown) {
  GreyRangeTracker tracker;
  tracker.add(*ramp(0, 1000), *ramp(0, 1000));
  for (const int bright : {1100, 900, 1150, 700, 1000, 800})
    EXPECT_FALSE(tracker.add(*ramp(0, bright), *ramp(20, bright)));
  for (const int bright : {16000, 300}) {
    int changes = 0;
    for (int i = 0; i < 10; ++i) changes += tracker.add(*ramp(0, bright), *ramp(0, bright));
    EXPECT_EQ(changes, 1) << bright;
    expectFits(tracker.range(), 0, bright);
  }
}

TEST(GreyRangeTracker, NoiseIsNotStretchedToAScene) {
  GreyRangeTracker tracker;
  tracker.add(*ramp(500, 505), *ramp(500, 505));
  EXPECT_GE(tracker.range().white - tracker.range().black, 64.0);
}

TEST(GreyRangeTracker, WhatIsSaturatedIsWhiteAndACoveredLensIsNot) {
  for (const int full : {1023, 4095, 65535, 4080, 65472}) {
    GreyRangeTracker tracker;
    for (int i = 0; i < 5; ++i) tracker.add(*ramp(0, full / 2), *ramp(0, full / 2));
    for (int i = 0; i < 5; ++i) tracker.add(*ramp(full, full), *ramp(full, full));
    EXPECT_GT(cv::mean(toGrey(ramp(full, full), tracker.range()))[0], 250.0) << full;
  }
  for (const int covered : {0, 60, 64, 240}) {
    GreyRangeTracker tracker;
    tracker.add(*ramp(covered, covered + 1), *ramp(covered, covered + 1));
    EXPECT_LT(cv::mean(toGrey(ramp(covered, covered + 1), tracker.range()))[0], 100.0) << covered;
  }
}

TEST(GreyRangeTracker, NotesNothingOfOtherEncodings) {
  GreyRangeTracker tracker;
  EXPECT_FALSE(tracker.add(*image("mono8", 2, 1, {255, 255}), *image("mono8", 2, 1, {255, 255})));
  EXPECT_EQ(tracker.range().white, 65535.0);
  EXPECT_THROW(tracker.add(*image("mono16", 2, 2, {0, 0, 0, 0}), *ramp(0, 9)), std::invalid_argument);
}

TEST(GreyRangeTracker, TheOtherSideMayHaveEightBits) {
  const auto grey = image("mono8", 2, 1, {255, 255});
  for (const bool is_left : {true, false}) {
    GreyRangeTracker tracker;
    const auto deep = ramp(0, 4095);
    EXPECT_TRUE(tracker.add(is_left ? *deep : *grey, is_left ? *grey : *deep));
    expectFits(tracker.range(), 0, 4095);
  }
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
  // U, Y, V, Y of two pixels.
  const std::vector<std::uint8_t> luminance = {90, kRed, 240, kGreen, 9, kBlue, 240, 40};
  expectPixels(toGrey(image("yuv422", 4, 1, luminance)), kRed, kBlue, "yuv422");
}

TEST(ToGrey, RefusesOtherEncodingsAndMalformedImages) {
  for (const std::string encoding : {"", "bayer_rggb8", "32FC1", "8UC3", "16UC1", "nonsense"})
    expectError([&] { toGrey(image(encoding, 2, 1, std::vector<std::uint8_t>(8, 0))); }, {"'" + encoding + "'"});
  constexpr std::uint32_t kStep = 8 * 4;
  for (const char* encoding : {"mono8", "8UC1", "mono16", "rgb8", "bgra8"})
    for (const auto& [bytes, step] : {std::pair(kStep * 3, kStep), {0u, kStep}, {4u * 4u, 4u}})  // cut, empty, narrow
      EXPECT_THROW(toGrey(image(encoding, 8, 4, std::vector<std::uint8_t>(bytes), step)), std::invalid_argument)
          << encoding << " of " << bytes;
}

}  // namespace sdvo::ros_conversions::test_grey_image
