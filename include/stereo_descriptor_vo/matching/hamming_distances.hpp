#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Numbers of bits in which a row differs from `count` rows of `others` (CV_8U, as wide as the row), named by
/// `candidates`.
void hammingDistances(const std::uint8_t* row, const cv::Mat& others, const int* candidates, std::size_t count,
                      float* distances);

}  // namespace sdvo
