#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/front_end/epipolar_matcher.hpp"

namespace sdvo {

struct StereoMatcherOptions {
  EpipolarMatcherOptions epipolar;
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

/// Left to right matching by a search along the row (paper, section 4: by feature tracking, which is slower and needs a
/// pyramid to reach large disparities).
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoMatcherOptions& options);

  /// Matches in the order of `left_positions`, those without a trusted match left out. Images are CV_8U of one size.
  /// `max_disparity`, px, in place of the options' one.
  std::vector<StereoMatch> match(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& left_positions,
                                 std::optional<double> max_disparity = std::nullopt) const;

 private:
  bool isTrusted(float disparity, float dv) const {
    return disparity >= options_.min_disparity && std::abs(dv) <= options_.max_epipolar_residual;
  }

  StereoMatcherOptions options_;
};

}  // namespace sdvo
