#include "mask_file.hpp"

#include <png.h>

namespace sdvo {

cv::Mat readMask(const std::string& file) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&header, file.c_str()) == 0) return {};
  header.format = PNG_FORMAT_GRAY;
  // Black, which whatever is transparent lets through.
  cv::Mat mask = cv::Mat::zeros(static_cast<int>(header.height), static_cast<int>(header.width), CV_8U);
  const int read = png_image_finish_read(&header, nullptr, mask.data, static_cast<png_int_32>(mask.step), nullptr);
  return read == 0 ? cv::Mat() : mask;
}

}  // namespace sdvo
