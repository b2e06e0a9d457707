#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/front_end/epipolar_matcher.hpp"

namespace sdvo {

/// How left positions are found in the right image: a block search along the row, or pyramidal Lucas-Kanade tracking.
enum class StereoMethod { kEpipolar, kLucasKanade };

inline const std::vector<std::string>& namesOf(StereoMethod) {
  static const std::vector<std::string> names = {"epipolar", "lk"};
  return names;
}

struct StereoMatcherOptions {
  StereoMethod method = StereoMethod::kEpipolar;
  EpipolarMatcherOptions epipolar;
  int window_radius = 9;
  int pyramid_levels = 4;
  double max_backward_error = 0.5;
  double max_epipolar_residual = 1.5;
  double min_disparity = 0.5;

  void describe(OptionList& list) {
    list.add("method", method, "block search along the row, or pyramidal Lucas-Kanade tracking");
    list.group("epipolar", epipolar);
    list.add("window_radius", window_radius, {2, 30}, "px", "lk: half side of the window");
    list.add("pyramid_levels", pyramid_levels, {0, 8}, "",
             "lk: levels above the full image; each doubles the disparity reached");
    list.add("max_backward_error", max_backward_error, {0.05, 5.0}, "px",
             "lk: largest distance between a corner and its track to the right image and back");
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

/// Left to right matching: by feature tracking (paper, section 4), or by a search along the row, which is faster and
/// needs no pyramid to reach large disparities.
class StereoMatcher {
 public:
  explicit StereoMatcher(const StereoMatcherOptions& options);

  /// Matches in the order of `left_positions`, those without a trusted match left out. Images are CV_8U of one size.
  std::vector<StereoMatch> match(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& left_positions) const;

 private:
  std::vector<StereoMatch> search(const cv::Mat& left, const cv::Mat& right,
                                  const std::vector<cv::Point2f>& left_positions) const;
  std::vector<StereoMatch> track(const cv::Mat& left, const cv::Mat& right,
                                 const std::vector<cv::Point2f>& left_positions) const;
  bool isTrusted(float disparity, float dv) const {
    return disparity >= options_.min_disparity && std::abs(dv) <= options_.max_epipolar_residual;
  }

  StereoMatcherOptions options_;
};

}  // namespace sdvo
