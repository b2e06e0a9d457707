#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// FAST corners of nine contiguous pixels (Rosten and Drummond 2006) of a CV_8U image: those of cv::FAST with
/// non-maximum suppression, scores included, at half of its time.
std::vector<cv::KeyPoint> findFastCorners(const cv::Mat& image, int threshold);

}  // namespace sdvo
