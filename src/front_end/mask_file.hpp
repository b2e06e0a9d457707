#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace sdvo {

/// A PNG as CV_8U; empty if it cannot be read. What is transparent is black. By libpng: OpenCV's readers bring a
/// hundred libraries, 40 MB, into every process.
cv::Mat readMask(const std::string& file);

}  // namespace sdvo
