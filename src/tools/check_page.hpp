#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../check/finding.hpp"

namespace sdvo {

/// All findings of a camera's check as one page that needs no other file: verdict, table, map of the rows, a pair of
/// images. `rows`: RowCheck::map(), empty: none; `pair`: CV_8U, empty: none. Throws std::runtime_error when it cannot
/// be written.
void writeCheckPage(const std::string& path, const std::string& camera, const std::vector<Finding>& findings,
                    const cv::Mat& rows, const cv::Mat& pair);

}  // namespace sdvo
