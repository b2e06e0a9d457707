#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace sdvo {

/// Whether a file of this name is an image that readGreyImage() reads: PNG or JPEG. Names that begin with a dot are some
/// file manager's.
bool isImageName(const std::string& name);

/// Reads a PNG or JPEG as CV_8U grey. Throws std::runtime_error that names the file when it is missing, of another
/// kind, truncated or damaged; cv::imread would return whatever could be decoded of it.
cv::Mat readGreyImage(const std::string& path);

/// In the format of the name's ending. Throws std::runtime_error that names the file when it cannot be written.
void writeImage(const std::string& path, const cv::Mat& image);

}  // namespace sdvo
