#pragma once

#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/options.hpp"

namespace sdvo {

struct PatchOptions {
  int patch_side = 13;
  double patch_spacing = 0.1;
  double patch_min_spacing = 1.0;

  void describe(OptionList& list) {
    list.add("patch_side", patch_side, {0, 16}, "samples", "side of the grey patch sent with each feature; 0: none");
    list.add("patch_spacing", patch_spacing, {0.01, 1.0}, "", "distance of its samples, as a share of the feature's size");
    list.add("patch_min_spacing", patch_min_spacing, {0.25, 10.0}, "px", "… but not less than this");
  }
};

class PatchSampler {
 public:
  PatchSampler(const PatchOptions& options, const cv::Mat& image);
  float spacing(float size) const;
  void sample(float u, float v, float spacing, std::uint8_t* patch) const;

 private:
  PatchOptions options_;
  cv::Mat integral_;
};

}  // namespace sdvo
