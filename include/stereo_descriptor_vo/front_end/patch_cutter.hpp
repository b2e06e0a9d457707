#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/descriptor_format.hpp"
#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct PatchOptions {
  int patch_side = 13;

  void describe(OptionList& list) {
    list.add("patch_side", patch_side, {0, kMostSamples}, "samples",
             "side of the grey patch sent with each feature, for its alignment between pairs; 0: none is sent");
  }

  /// Samples are a tenth of the feature's size apart, and at least 1 px.
  PatchLayout layout() const { return {patch_side, 1.f, 0.1f}; }

  static constexpr int kMostSamples = 16;
};

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
