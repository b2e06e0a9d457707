#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct EpipolarOptions {
  double max_disparity = 192.0;
  double uniqueness = 0.9;
  double min_correlation = 0.8;

  void describe(OptionList& list) {
    list.add("max_disparity", max_disparity, {4.0, 2000.0}, "px", "largest disparity looked for, before alignment");
    list.add("uniqueness", uniqueness, {0.1, 1.0}, "",
             "largest ratio between the difference of the best block and that of the best one elsewhere");
    list.add("min_correlation", min_correlation, {0.0, 1.0}, "", "least correlation of the aligned patches");
  }
};

struct StereoMatcherOptions {
  EpipolarOptions epipolar;
  double max_epipolar_residual = 1.5;
  double min_disparity = 0.5;

  void describe(OptionList& list) {
    list.group("epipolar", epipolar);
    list.add("max_epipolar_residual", max_epipolar_residual, {0.1, 4.0}, "px",
             "largest difference of the rows in both views; KITTI's rectification really leaves up to 1.3");
    list.add("min_disparity", min_disparity, {0.01, 50.0}, "px", "smallest disparity of a point at finite depth");
  }
  /// Throws std::invalid_argument when no disparity is left to look for.
  void check() const;
};

/// Where a left corner was found in the right image.
struct StereoMatch {
  int left_index;   ///< index into the left positions
  float disparity;  ///< u_left - u_right, px, sub-pixel, positive
  float dv;         ///< v_right - v_left, px
};

/// Finds left positions in the right image (paper, section 4: by feature tracking, which is slower and needs a pyramid
/// for large disparities). Blocks are compared along the row at half resolution, then around the best one at full
/// resolution. There the patch is aligned to sub-pixel precision in both directions.
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoMatcherOptions& options);

  /// Matches in the order of `left_positions`. A position has none if no block stands out, if the alignment moves by
  /// more than 2 px, or if the aligned patches differ. Images are CV_8U of one size. `max_disparity`, px, replaces that
  /// of the options.
  std::vector<StereoMatch> match(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& left_positions,
                                 std::optional<double> max_disparity = std::nullopt) const;

 private:
  StereoMatcherOptions options_;
};

}  // namespace sdvo
