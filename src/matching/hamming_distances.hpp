#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>

namespace sdvo {

/// Numbers of bits in which a descriptor differs from `count` of the others (CV_8U, one in each row of the matrix),
/// whose indices are `candidates`.
void hammingDistances(const std::uint8_t* descriptor, const cv::Mat& others, const int* candidates, std::size_t count,
                      float* distances);

}  // namespace sdvo
