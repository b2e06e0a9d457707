#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

constexpr int kAlignedRadius = 4;                        ///< samples: half side of the part that is aligned
constexpr int kLeastPatchSide = 2 * kAlignedRadius + 3;  ///< derivatives need one sample more on each side

/// Whether patches of so many samples a side can be aligned.
constexpr bool canAlign(int patch_side) {
  return patch_side >= kLeastPatchSide;
}
/// A warning if patches are too small to be aligned; empty if they are large enough, or if there are none.
std::string alignmentComplaint(int patch_side);

/// A grey patch as it travels with a feature: side x side samples, row by row.
struct Patch {
  const std::uint8_t* samples = nullptr;
  int side = 0;
  float spacing = 1.f;  ///< px
};

/// Where a point of one patch lies in another.
struct PatchShift {
  Eigen::Vector2f shift;  ///< from the middle of the current patch, px
  float sigma;            ///< standard deviation of each coordinate, px
  float correlation;      ///< of the two patches there
};

/// Finds a point of the reference patch in the current one. The point lies at `centre` (samples from the middle of the
/// reference). The search begins in the current patch's middle. It is an inverse compositional alignment (Baker and
/// Matthews 2004), blind to brightness and contrast. `warp` takes offsets in the reference image to offsets in the
/// current one, px; mostly a scale by the ratio of the depths. Nothing where the patches differ (an occluding edge,
/// another point), have too little texture, or where the result lies outside. `noise`: of the corner in the current
/// patch's middle, which bounds the shift.
std::optional<PatchShift> alignPatch(const NoiseOptions& noise, const Patch& reference, const Eigen::Vector2f& centre,
                                     const Patch& current, const Eigen::Matrix2f& warp);

}  // namespace sdvo
