#pragma once

#include <opencv2/core.hpp>

namespace sdvo {

/// Standard deviation, grey levels, of the noise of a CV_8U image, at least that of rounding to whole levels. It is the
/// median response to Immerkaer's mask (Fast Noise Variance Estimation, 1996), in place of his mean: edges and fine
/// texture are outliers. Black and white pixels do not count, as their noise is cut off.
double noiseOf(const cv::Mat& image);

}  // namespace sdvo
