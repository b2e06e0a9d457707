#pragma once

#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct ExposureBalanceOptions {
  bool enabled = true;
  double tolerance = 0.15;

  void describe(OptionList& list) {
    list.add("enabled", enabled, "match left and right as if they were equally exposed");
    list.add("tolerance", tolerance, {0.0, 10.0}, "",
             "only where one side is brighter by more than this share of the other's mean grey level");
  }
};

/// Makes a pair equally exposed for the search from left to right, which compares grey levels. The darker image takes
/// the levels of the brighter one, so that equal ratios of both are darker (histogram specification). That holds for a
/// gain, an offset, another response curve, and where the brighter one is saturated. Stateless.
class ExposureBalance {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit ExposureBalance(const ExposureBalanceOptions& options) : options_(checked(options)) {}

  /// CV_8U images of one size and their mean grey levels. An image that is changed gets memory of its own; images
  /// that differ little in most parts, or of which one shows next to nothing (dark, covered), are left alone.
  void apply(double left_mean, double right_mean, cv::Mat& left, cv::Mat& right) const;

 private:
  ExposureBalanceOptions options_;
};

}  // namespace sdvo
