#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct EpipolarMatcherOptions {
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

/// Finds left positions in the right image. Blocks are compared along the row at half resolution, then around the best
/// one at full resolution. There the patch is aligned to sub-pixel precision in both directions.
class EpipolarMatcher {
 public:
  /// What the matcher works on. Memory of this size is slow to get from the system for every pair; kept by the caller,
  /// it is there already.
  struct Images {
    cv::Mat left, right;            ///< full resolution, with a margin
    cv::Mat left_half, right_half;  ///< half resolution, with a margin
    cv::Mat half;                   ///< one of them before it gets the margin
  };

  /// Images are CV_8U of one size. `max_dv` in px bounds |v_right - v_left|. The matcher fills and reads `scratch`,
  /// which must outlive it and serve no other matcher meanwhile.
  EpipolarMatcher(const EpipolarMatcherOptions& options, double max_dv, const cv::Mat& left, const cv::Mat& right,
                  Images& scratch);

  /// (disparity, dv) of a left position, px; nothing where no block stands out, the alignment leads
  /// more than 2 px away or the aligned patches differ.
  std::optional<cv::Point2f> find(const cv::Point2f& left_position) const;

 private:
  std::optional<int> searchRow(const cv::Point2f& left_position) const;
  cv::Point2f searchAround(const cv::Point& left, int disparity) const;
  std::optional<cv::Point2f> align(const cv::Point2f& left_position, const cv::Point2f& start) const;

  EpipolarMatcherOptions options_;
  double max_dv_;
  double noise_;  ///< of the left image, grey levels
  const Images& images_;
};

}  // namespace sdvo
