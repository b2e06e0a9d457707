#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

enum class DetectorType { kFast, kGftt, kOrb, kSift };

inline const std::vector<std::string>& namesOf(DetectorType) {
  static const std::vector<std::string> names = {"fast", "gftt", "orb", "sift"};
  return names;
}

struct FeatureDetectorOptions {
  DetectorType type = DetectorType::kFast;
  int max_features = 600;
  int bucket_size = 50;
  double min_spacing = 0.0;
  double min_contrast = 9.0;
  double corner_quality = 0.002;
  bool subpixel = true;
  std::string mask;

  void describe(OptionList& list) {
    list.add("type", type, "corner detector");
    list.add("max_features", max_features, {1, 20000}, "", "corners kept per left image");
    list.add("bucket_size", bucket_size, {8, 4096}, "px", "side of the square buckets that share the corners evenly");
    list.add("min_spacing", min_spacing, {0.0, 100.0}, "px",
             "corners nearer than this to a stronger one are left out; 0: none is");
    list.add("min_contrast", min_contrast, {1.0, 100.0}, "sigma of the image's noise",
             "fast, orb: weakest corner considered; down to a quarter of it where there are too few");
    list.add("corner_quality", corner_quality, {1e-6, 1.0}, "", "gftt: weakest response relative to the best");
    list.add("subpixel", subpixel, "fast, gftt: refine corners to sub-pixel positions");
    list.add("mask", mask, "PNG (absolute path) of the left image's size: no corners where it is black; empty: none");
  }
  /// Throws std::invalid_argument when the OpenCV at hand lacks the detector.
  void check() const;
};

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
