#pragma once

#include <opencv2/core.hpp>

namespace sdvo {

/// Makes a pair equally exposed for the search from left to right, which compares grey levels. The darker image gets
/// the histogram of the brighter one (histogram specification). This compensates a gain, an offset, another response
/// curve and saturation of the brighter one. Images are CV_8U of one size, with their mean grey levels. A changed image
/// is a new one. Images that differ little in most parts, or of which one is black (dark, covered), stay as they are.
void balanceExposures(double left_mean, double right_mean, cv::Mat& left, cv::Mat& right);

}  // namespace sdvo
