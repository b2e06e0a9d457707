#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "../../src/front_end/stereo_matcher.hpp"

namespace sdvo {

/// Finds left positions in the right image by pyramidal Lucas-Kanade tracking there and back (paper, section 4), in
/// their order. Those are left out that do not come back to within half a pixel, or whose disparity or rows
/// `options` do not allow. Images are CV_8U of one size.
std::vector<StereoMatch> trackToRight(const cv::Mat& left, const cv::Mat& right,
                                      const std::vector<cv::Point2f>& left_positions,
                                      const StereoMatcherOptions& options);

}  // namespace sdvo
