#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// A corner in the left image.
struct Corner {
  cv::Point2f position;  ///< px, sub-pixel
  float response;        ///< detector's own score, comparable within one image only
};

/// Finds corners and spreads them evenly over the image. Stateless: the same image gives the same corners.
class FeatureDetector {
 public:
  /// Throws std::invalid_argument when an option is out of its range, or names a mask that cannot be read.
  explicit FeatureDetector(const FeatureDetectorOptions& options);

  static constexpr int kSmallestSide = 16;  ///< px within the border: less is no image for the detectors

  /// Corners of a CV_8U image, at most `max_features`. They lie at least `border` px away from the image's borders and
  /// outside of the mask's zeros; the sub-pixel refinement may move them a little further. `mask` is CV_8U, or empty
  /// for the one of the options. Throws std::invalid_argument when the mask has another type, or another size than the
  /// image.
  std::vector<Corner> detect(const cv::Mat& image, int border = 0, const cv::Mat& mask = cv::Mat()) const;

 private:
  FeatureDetectorOptions options_;
  cv::Mat mask_;  ///< of the file; empty: none
};

/// Without the corners that lie nearer than `min_spacing` px to a stronger one that is kept; strongest first. Corners a
/// few px apart have nearly equal descriptors, which are matched with each other. The order of the input is irrelevant.
std::vector<Corner> keepApart(std::vector<Corner> corners, double min_spacing);

/// Keeps `max_count` corners, as equally many in each bucket of a grid of `bucket_size` px as there are, the strongest
/// of each bucket first. Ties are broken by position, so the order of the input is irrelevant.
std::vector<Corner> spreadOverBuckets(const std::vector<Corner>& corners, cv::Size image_size, int bucket_size,
                                      int max_count);

}  // namespace sdvo
