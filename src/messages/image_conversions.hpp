#pragma once

#include <sensor_msgs/Image.h>

#include <array>
#include <deque>
#include <opencv2/core.hpp>
#include <string>

namespace sdvo::ros_conversions {

/// Counts of a mono16 image that become black and white.
struct GreyRange {
  double black = 0.0, white = 65535.0;
};

/// Begin of the encoding of a compressed image that could not be decoded; its format follows.
inline const std::string kUndecoded = "undecoded ";

/// CV_8U grey pixels of mono8, 8UC1, mono16, bgr8, rgb8, bgra8, rgba8 and yuv422. The result may share the message's
/// memory: the message must outlive it. `range`: for mono16 only. Throws std::invalid_argument for any other encoding
/// and for images whose size and data disagree.
cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, const GreyRange& range = {});

/// The grey range of a stream of mono16 pairs, from cameras of any bit depth and offset. It covers 96 % of the pixels
/// of the last pairs, so that neither a lamp nor a damaged image sets it. It changes only if it does not fit any more,
/// so that grey levels are comparable from pair to pair. Other encodings are ignored.
class GreyRangeTracker {
 public:
  /// Returns whether the range has changed. Throws as toGrey() does.
  bool add(const sensor_msgs::Image& left, const sensor_msgs::Image& right);

  const GreyRange& range() const { return range_; }

 private:
  std::deque<std::array<double, 3>>
      last_;  ///< counts below and above which 2 % of a pair's pixels lie, and the largest
  GreyRange range_;
};

}  // namespace sdvo::ros_conversions
