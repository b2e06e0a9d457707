#include "stereo_descriptor_vo/front_end/image_margin.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace sdvo {

void addMargin(const cv::Mat& image, int margin, cv::Mat& larger) {
  CV_Assert(image.type() == CV_8UC1 && !image.empty());
  larger.create(image.rows + 2 * margin, image.cols + 2 * margin, CV_8U);
  const std::size_t beside = static_cast<std::size_t>(margin), columns = static_cast<std::size_t>(image.cols);
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* row = image.ptr(y);
    std::uint8_t* to = larger.ptr(y + margin);
    std::memset(to, row[0], beside);
    std::memcpy(to + beside, row, columns);
    std::memset(to + beside + columns, row[columns - 1], beside);
  }
  const int last = margin + image.rows - 1;
  for (int k = 1; k <= margin; ++k) {
    std::memcpy(larger.ptr(margin - k), larger.ptr(margin), columns + 2 * beside);
    std::memcpy(larger.ptr(last + k), larger.ptr(last), columns + 2 * beside);
  }
}

}  // namespace sdvo
