#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace sdvo {

/// A PNG as CV_8U. What is transparent is black. Throws std::invalid_argument that names the file when it cannot be
/// read or is larger than any camera's image. By libpng: OpenCV's readers bring a hundred libraries, 40 MB, into every
/// process.
cv::Mat readMask(const std::string& file);

}  // namespace sdvo
