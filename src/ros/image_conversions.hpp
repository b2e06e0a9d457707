#pragma once

#include <sensor_msgs/Image.h>

#include <opencv2/core.hpp>

namespace sdvo::ros_conversions {

/// Bits that the brightest pixel needs: 10, 12, 14 or 16 for mono16, as which cameras of any depth send their images; 8
/// for every other encoding and for a dark image. Throws as toGrey() does.
int bitDepth(const sensor_msgs::Image& message);

/// CV_8U grey pixels of mono8, 8UC1, mono16, bgr8, rgb8, bgra8 and rgba8; shares the message's memory where it can, so
/// that the message must outlive the result. `bits`: mono16 only, depth of the pixel that becomes 255.
/// Throws std::invalid_argument for any other encoding and for images whose size and data disagree.
cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, int bits = 16);

}  // namespace sdvo::ros_conversions
