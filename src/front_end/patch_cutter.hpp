#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/descriptor_format.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// Cuts grey patches out of one image.
class PatchCutter {
 public:
  /// `image` must be CV_8UC1; only its integral is kept.
  PatchCutter(const PatchLayout& layout, const cv::Mat& image);

  /// Writes layout.bytes() samples of the patch around (u, v) px for a feature of `size` px. A square that crosses the
  /// image's border gets the mean of its part inside; one beyond it is black.
  void cut(float u, float v, float size, std::uint8_t* samples) const;

 private:
  PatchLayout layout_;
  cv::Mat integral_;  ///< CV_32S; sums beyond 2^31 wrap around, differences of them do not
};

}  // namespace sdvo
