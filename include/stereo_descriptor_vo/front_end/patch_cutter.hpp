#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/descriptor_format.hpp"
#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct PatchOptions {
  int patch_side = 13;
  double patch_min_spacing = 1.0;
  double patch_spacing = 0.1;

  void describe(OptionList& list) {
    list.add("patch_side", patch_side, {0, kMostSamples}, "samples",
             "side of the grey patch sent with each feature, for its alignment between pairs; 0: none is sent");
    list.add("patch_min_spacing", patch_min_spacing, {0.25, 10.0}, "px", "least distance of a patch's samples");
    list.add("patch_spacing", patch_spacing, {0.0, 1.0}, "", "their distance as a share of the feature's size");
  }

  PatchLayout layout() const {
    return {patch_side, static_cast<float>(patch_min_spacing), static_cast<float>(patch_spacing)};
  }

  static constexpr int kMostSamples = 16;
};

/// Cuts grey patches out of one image.
class PatchCutter {
 public:
  /// `image` must be CV_8UC1; only its integral is kept.
  PatchCutter(const PatchLayout& layout, const cv::Mat& image);

  /// Writes layout.bytes() samples of the patch around (u, v) px for a feature of `size` px. Of squares that
  /// cross the image's border it is the mean of the part inside; those beyond are black.
  void cut(float u, float v, float size, std::uint8_t* samples) const;

 private:
  PatchLayout layout_;
  cv::Mat integral_;  ///< CV_32S; sums beyond 2^31 wrap around, differences of them do not
};

}  // namespace sdvo
