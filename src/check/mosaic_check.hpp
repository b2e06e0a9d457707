#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>

#include "finding.hpp"

namespace sdvo {

/// Ratio of an image's blocks (CV_8U) with a chequered pattern of two pixels, as the mosaic of a colour sensor has it,
/// also after it was rectified. No scene has it: lenses and pixels blur what is as fine.
double mosaicShare(const cv::Mat& image);

/// A copy of an image without that pattern: smoothed over three pixels, which leaves nothing of a period of two.
cv::Mat withoutMosaic(const cv::Mat& image);

/// Whether images are a colour sensor's mosaic under the name of grey ones.
class MosaicCheck {
 public:
  /// Looks at the next pair, CV_8UC1, and returns it without the pattern, where a side has it.
  std::array<cv::Mat, 2> add(const cv::Mat& left, const cv::Mat& right);

  /// Fault in words, of the last pairs; empty: none.
  std::string problem() const;
  Finding judge() const;

 private:
  int pairs_ = 0;
  double left_ = 0.0, right_ = 0.0;  ///< of the last pair that was looked at
};

}  // namespace sdvo
