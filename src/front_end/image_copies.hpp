#pragma once

#include <opencv2/core.hpp>

namespace sdvo {

/// A CV_8U image at half its resolution, odd sizes rounded up. The pixels are those of cv::resize with INTER_AREA,
/// which takes forty times longer for odd sizes than for even ones.
void halveImage(const cv::Mat& image, cv::Mat& half);

/// A CV_8U image that goes on as its outermost pixels for `margin` px on every side: cv::copyMakeBorder with
/// BORDER_REPLICATE, several times faster. `larger` keeps its memory where that has the size.
void addMargin(const cv::Mat& image, int margin, cv::Mat& larger);

}  // namespace sdvo
