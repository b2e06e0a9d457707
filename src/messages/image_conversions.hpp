#pragma once

#include <sensor_msgs/Image.h>

#include <array>
#include <deque>
#include <opencv2/core.hpp>

namespace sdvo::ros_conversions {

/// Counts of a mono16 image that become black and white.
struct GreyRange {
  double black = 0.0, white = 65535.0;
};

/// CV_8U grey pixels of mono8, 8UC1, mono16, bgr8, rgb8, bgra8, rgba8 and yuv422; shares the message's memory where it
/// can, so that the message must outlive the result. `range`: of mono16 only. Throws std::invalid_argument for any
/// other encoding and for images whose size and data disagree.
cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, const GreyRange& range = {});

/// The grey range of a stream of mono16 pairs, which cameras of any depth and offset send: follows the counts between
/// which 96 % of the pixels of the last pairs lie, so that no lamp and no damaged image sets it, and stays while these
/// fit, so that a grey level means the same from pair to pair. Of other encodings nothing is noted.
class GreyRangeTracker {
 public:
  /// Throws as toGrey() does. Whether the range is another one now.
  bool add(const sensor_msgs::Image& left, const sensor_msgs::Image& right);

  const GreyRange& range() const { return range_; }

 private:
  std::deque<std::array<double, 3>>
      last_;  ///< counts below and above which 2 % of a pair's pixels lie, and the largest
  GreyRange range_;
};

}  // namespace sdvo::ros_conversions
