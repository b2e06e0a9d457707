#include "mask_file.hpp"

#include <png.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>

#include "../common/text.hpp"

namespace sdvo {

cv::Mat readMask(const std::string& file) {
  constexpr std::uint64_t kMostPixels =
      50'000'000;  // of stereo cameras at most 12 million; a wrong file takes no memory
  const std::string name = "'" + std::filesystem::absolute(file).string() + "'";
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  // A pipe would be waited for.
  if (!std::filesystem::is_regular_file(file) || png_image_begin_read_from_file(&header, file.c_str()) == 0)
    throw std::invalid_argument("cannot read a PNG from " + name);
  if (std::uint64_t{header.width} * header.height > kMostPixels) {
    png_image_free(&header);
    throw std::invalid_argument(text(0, name, " has ", header.width, "x", header.height,
                                     " px: a mask has the size of the rectified left image"));
  }
  header.format = PNG_FORMAT_GRAY;
  // Black, which whatever is transparent lets through.
  cv::Mat mask = cv::Mat::zeros(static_cast<int>(header.height), static_cast<int>(header.width), CV_8U);
  if (png_image_finish_read(&header, nullptr, mask.data, static_cast<png_int_32>(mask.step), nullptr) == 0)
    throw std::invalid_argument("cannot read all of the PNG " + name + ": is it truncated?");
  return mask;
}

}  // namespace sdvo
