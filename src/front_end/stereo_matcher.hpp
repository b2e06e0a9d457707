#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// Where a left corner was found in the right image.
struct StereoMatch {
  int left_index;      ///< index into the left positions
  float disparity;     ///< u_left - u_right, px, sub-pixel, positive
  float dv;            ///< v_right - v_left, px
  float period = 0.f;  ///< px; the texture repeats after it, and the disparity may be off by it; 0: unique
};

/// Finds left positions in the right image (paper, section 4: by feature tracking, which is slower and needs a pyramid
/// for large disparities). Blocks are compared along the row at half resolution, then around the best one at full
/// resolution. There the patch is aligned to sub-pixel precision in both directions.
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoMatcherOptions& options);

  /// Matches in the order of `left_positions`. A position has none if no block stands out, if the alignment moves by
  /// more than 2 px, or if the aligned patches differ. Images are CV_8U of one size. `max_disparity`, px, replaces that
  /// of the options. In views whose texture repeats along the rows, matches have a period, unless unique ones around
  /// agree.
  std::vector<StereoMatch> match(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& left_positions,
                                 std::optional<double> max_disparity = std::nullopt) const;

 private:
  StereoMatcherOptions options_;
};

}  // namespace sdvo
