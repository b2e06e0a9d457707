#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace sdvo {

/// Foerstner's intersection of gradient lines, as cv::cornerSubPix finds it but several times faster.
class CornerRefiner {
 public:
  /// `image` is CV_8U, `radius` half the side of the window in px. All starts lie `clearance` px or more inside of the
  /// image. Where that is not enough, `scratch` gets a larger copy of it, must outlive the refiner and serve no other
  /// one meanwhile: memory of this size is slow to get for every image.
  CornerRefiner(const cv::Mat& image, int radius, int clearance, cv::Mat& scratch);

  /// The corner near `start`, or nothing where it is further away than `largest_shift` px.
  std::optional<cv::Point2f> refine(const cv::Point2f& start, float largest_shift) const;

 private:
  int stride() const;

  int radius_, margin_;
  cv::Mat image_;                      ///< with the margin
  std::vector<float> weight_, x_, y_;  ///< of the square's pixels, in rows of stride()
};

}  // namespace sdvo
