#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace sdvo {

/// A corner of the left image and where it is in the right one.
struct FoundCorner {
  double u, v;       ///< px, in the left image
  double disparity;  ///< u_left - u_right, px; negative where the sides are swapped
  double dv;         ///< v_right - v_left, px
};

/// Looks for corners of the left image in all directions of the right one, to a pixel, blind to gain and brightness.
class BlockSearch {
 public:
  /// Images are CV_8U of one size and must outlive the search. It reaches `max_disparity` px to the left and to the
  /// right, and `reach` rows up and down.
  BlockSearch(const cv::Mat& left, const cv::Mat& right, double max_disparity, double reach);

  /// Nothing where texture is flat or repeats itself, or where the search from right to left ends elsewhere.
  std::optional<FoundCorner> find(const cv::Point2f& corner) const;

 private:
  const cv::Mat left_, right_;
  cv::Mat small_left_, small_right_;  ///< a quarter of the size
  double flat_;                       ///< grey levels
  cv::Size reach_;                    ///< px of a quarter of the size
};

}  // namespace sdvo
