#include "image_conversions.hpp"

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo::ros_conversions {
namespace {

namespace encodings = sensor_msgs::image_encodings;

/// The pixels of an image as `encoding` (empty: the message's own); shares the message's
/// memory where nothing is converted.
cv::Mat pixelsOf(const sensor_msgs::Image& message, const std::string& encoding = "") {
  try {
    if (message.data.empty()) throw cv_bridge::Exception("there are no pixels");
    return cv_bridge::toCvShare(message, nullptr, encoding)->image;
  } catch (const cv_bridge::Exception& e) {
    throw std::invalid_argument(text(0, "malformed image: ", message.data.size(), " bytes in rows of ", message.step,
                                     " for ", message.width, "x", message.height, " pixels of ", message.encoding) +
                                ": " + e.what());
  }
}

/// The pixels of a mono16 image. Not all by cv_bridge: its 1.16 gives freed memory where it swaps bytes.
cv::Mat pixelsOf16Bits(const sensor_msgs::Image& message) {
  if (message.is_bigendian == 0) return pixelsOf(message);
  sensor_msgs::Image bytes = message;
  bytes.encoding = encodings::TYPE_8UC2;
  const cv::Mat from = pixelsOf(bytes);
  cv::Mat swapped(from.size(), CV_8UC2);
  const int from_to[] = {0, 1, 1, 0};
  cv::mixChannels(&from, 1, &swapped, 1, from_to, 2);
  return cv::Mat(swapped.rows, swapped.cols, CV_16U, swapped.data, swapped.step).clone();
}

/// Appends some thousand pixels, evenly spread over the image.
void sample(const cv::Mat& pixels, std::vector<double>& counts) {
  constexpr double kSamples = 4096;
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels.total() / kSamples)));
  for (int row = step / 2; row < pixels.rows; row += step)
    for (int column = step / 2; column < pixels.cols; column += step)
      counts.push_back(pixels.at<std::uint16_t>(row, column));
}

/// Whether a count is the largest of a sensor of 8 or more bits, in low or high bits of the pixel: 0x0fff, 0xfff0.
bool isFullScale(double count) {
  const auto bits = static_cast<std::uint32_t>(count), lowest = bits & (~bits + 1u);
  return bits > 0 && bits / lowest >= 255 && (bits & (bits + lowest)) == 0;
}

}  // namespace

bool GreyRangeTracker::add(const sensor_msgs::Image& left, const sensor_msgs::Image& right) {
  constexpr std::size_t kPairs = 5;    // of which the median is taken: two in a row may be damaged
  constexpr double kShare = 0.02;      // of the pixels, beyond the range at either end (chosen)
  constexpr double kMargin = 0.25;     // of the spread, on either side of it (chosen)
  constexpr double kLeastSpread = 64;  // counts: less is noise more than a scene (chosen)
  constexpr double kMostUnused = 3.0;  // largest ratio of the range to the spread; a new range has 1.5
  std::vector<double> counts;
  for (const sensor_msgs::Image* image : {&left, &right})  // the other one may be of 8 bits
    if (image->encoding == encodings::MONO16) sample(pixelsOf16Bits(*image), counts);
  if (counts.empty()) return false;
  last_.push_back({quantile(counts, kShare), quantile(counts, 1.0 - kShare), quantile(counts, 1.0)});
  if (last_.size() > kPairs) last_.pop_front();
  const auto median = [this](std::size_t end) {
    std::vector<double> values;
    for (const auto& pair : last_) values.push_back(pair[end]);
    return quantile(values, 0.5);
  };
  const double dark = median(0), bright = median(1), spread = std::max(bright - dark, kLeastSpread);
  if (last_.size() > 1 && dark >= range_.black && bright <= range_.white &&
      range_.white - range_.black <= kMostUnused * spread)
    return false;
  // Saturated pixels become white, so that over-exposure is visible.
  const double white =
      bright >= median(2) && isFullScale(bright) ? bright : std::min(dark + (1.0 + kMargin) * spread, 65535.0);
  range_ = {std::max(0.0, std::min(dark - kMargin * spread, white - kLeastSpread)), white};
  return true;
}

cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, const GreyRange& range) {
  static const std::set<std::string> kConverted = {encodings::BGR8, encodings::RGB8, encodings::BGRA8, encodings::RGBA8,
                                                   encodings::YUV422};
  if (message->encoding == encodings::MONO8 || message->encoding == encodings::TYPE_8UC1) return pixelsOf(*message);
  if (kConverted.count(message->encoding) > 0) return pixelsOf(*message, encodings::MONO8);
  if (message->encoding == encodings::MONO16) {
    cv::Mat grey;
    const double scale = 255.0 / (range.white - range.black);
    pixelsOf16Bits(*message).convertTo(grey, CV_8U, scale, -scale * range.black);
    return grey;
  }
  if (message->encoding.rfind(kUndecoded, 0) == 0)
    throw std::invalid_argument(
        "a compressed image of format '" + message->encoding.substr(kUndecoded.size()) +
        "' cannot be decoded: JPEG, PNG and WebP can, unless they are torn. Republish others as "
        "raw images (image_transport republish); depth images are no camera's");
  throw std::invalid_argument("encoding '" + message->encoding +
                              "' is not supported: mono8, 8UC1, mono16, bgr8, rgb8, bgra8, rgba8 and yuv422 are; "
                              "stereo_raw.launch converts Bayer images");
}

}  // namespace sdvo::ros_conversions
