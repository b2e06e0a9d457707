#pragma once

#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Half side of the largest patch, px.
constexpr int kLargestPatchRadius = 32;

/// Values that a row of a sampled patch takes: the square's side rounded up, so that whole registers can be worked on.
constexpr int patchStride(int radius) {
  return (2 * radius + 4) / 4 * 4;
}

/// Samples the square of side 2 radius + 1 around a sub-pixel position, bilinearly, row by row of `columns` values:
/// those beyond the square are its neighbours on the right. `image` is CV_8U with a border of `margin` px around the
/// picture, to whose pixels (x, y) refers; such rows and one pixel more must lie inside of it. `slant` shifts row j
/// from the centre by -slant * j px.
void samplePatch(const cv::Mat& image, int margin, float x, float y, float slant, int radius, int columns,
                 float* patch);

}  // namespace sdvo
