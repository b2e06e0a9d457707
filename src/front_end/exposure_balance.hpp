#pragma once

#include <opencv2/core.hpp>

namespace sdvo {

/// Makes a pair equally exposed for the search from left to right, which compares grey levels. The darker image takes
/// the levels of the brighter one, so that equal ratios of both are darker (histogram specification). That holds for a
/// gain, an offset, another response curve, and where the brighter one is saturated. Images are CV_8U of one size, with
/// their mean grey levels. An image that is changed gets memory of its own; images that differ little in most parts, or
/// of which one shows next to nothing (dark, covered), are left alone.
void balanceExposures(double left_mean, double right_mean, cv::Mat& left, cv::Mat& right);

}  // namespace sdvo
