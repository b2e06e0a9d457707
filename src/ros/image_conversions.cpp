#include "image_conversions.hpp"

#include <sensor_msgs/image_encodings.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace sdvo::ros_conversions {
namespace {

namespace encodings = sensor_msgs::image_encodings;

/// The pixels of an image, of some bytes each; refers to the message. Not by cv_bridge, which brings OpenCV's readers
/// of image files and with them 40 MB of libraries.
cv::Mat pixelsOf(const sensor_msgs::Image& message, int bytes) {
  const std::size_t rows = message.height, columns = message.width, step = message.step;
  if (rows == 0 || columns == 0 || step < static_cast<std::size_t>(bytes) * columns ||
      message.data.size() < step * rows)
    throw std::invalid_argument("malformed image: " + std::to_string(message.data.size()) + " bytes in rows of " +
                                std::to_string(step) + " for " + std::to_string(columns) + "x" + std::to_string(rows) +
                                " pixels of " + std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes"));
  return cv::Mat(static_cast<int>(rows), static_cast<int>(columns), CV_8UC(bytes),
                 const_cast<std::uint8_t*>(message.data.data()), step);
}

/// The pixels of a mono16 image in this machine's order of bytes; refers to the message where that is its order.
cv::Mat pixelsOf16Bits(const sensor_msgs::Image& message) {
  const cv::Mat bytes = pixelsOf(message, 2);
  const std::uint16_t probe = 1;
  const bool machine_is_bigendian = *reinterpret_cast<const std::uint8_t*>(&probe) == 0;
  if ((message.is_bigendian != 0) == machine_is_bigendian)
    return cv::Mat(bytes.rows, bytes.cols, CV_16U, bytes.data, bytes.step);
  cv::Mat swapped(bytes.size(), CV_8UC2);
  const int from_to[] = {0, 1, 1, 0};
  cv::mixChannels(&bytes, 1, &swapped, 1, from_to, 2);
  return cv::Mat(swapped.rows, swapped.cols, CV_16U, swapped.data, swapped.step).clone();
}

}  // namespace

int bitDepth(const sensor_msgs::Image& message) {
  if (message.encoding != encodings::MONO16) return 8;
  double brightest = 0.0;
  cv::minMaxLoc(pixelsOf16Bits(message), nullptr, &brightest);
  for (int bits = 8; bits < 16; bits += 2)
    if (brightest < (1 << bits)) return bits;
  return 16;
}

cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, int bits) {
  if (message->encoding == encodings::MONO8 || message->encoding == encodings::TYPE_8UC1) return pixelsOf(*message, 1);
  cv::Mat grey;
  if (message->encoding == encodings::MONO16) {
    pixelsOf16Bits(*message).convertTo(grey, CV_8U, 255.0 / ((1 << bits) - 1));
    return grey;
  }
  static const std::map<std::string, cv::ColorConversionCodes> colours = {{encodings::BGR8, cv::COLOR_BGR2GRAY},
                                                                          {encodings::RGB8, cv::COLOR_RGB2GRAY},
                                                                          {encodings::BGRA8, cv::COLOR_BGRA2GRAY},
                                                                          {encodings::RGBA8, cv::COLOR_RGBA2GRAY}};
  const auto colour = colours.find(message->encoding);
  if (colour == colours.end())
    throw std::invalid_argument("encoding '" + message->encoding +
                                "' is not supported: mono8, 8UC1, mono16, bgr8, rgb8, bgra8 and rgba8 are; "
                                "stereo_raw.launch converts Bayer images");
  cv::cvtColor(pixelsOf(*message, encodings::numChannels(message->encoding)), grey, colour->second);
  return grey;
}

}  // namespace sdvo::ros_conversions
