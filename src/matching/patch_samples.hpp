#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "patch_alignment.hpp"

namespace sdvo {

/// Affine map from the square to positions in a patch: of its middle, and of a step along x and along y.
struct PatchPlacement {
  float x, y, x_by_x, x_by_y, y_by_x, y_by_y;
};

/// Values on a square of samples, row by row, then zeros: kernels write two registers behind it.
constexpr int kSampledSide = 2 * kAlignedRadius + 1;
constexpr int kSamples = kSampledSide * kSampledSide + 2 * 8;
using Samples = std::array<float, kSamples>;

/// A copy of a patch with room behind it, so that kernels may read whole registers.
class PaddedPatch {
 public:
  void take(const Patch& patch);

  const std::uint8_t* samples() const { return samples_.data(); }
  int side() const { return side_; }

 private:
  std::vector<std::uint8_t> samples_;
  int side_ = 0;
};

/// The square of samples that are aligned.
class SampleSquare {
 public:
  SampleSquare();

  static constexpr int side() { return kSampledSide; }
  static constexpr int pixels() { return kSampledSide * kSampledSide; }
  /// Pixels and what fills the last register.
  static constexpr int count() { return (pixels() + 7) / 8 * 8; }
  const float* mask() const { return mask_.data(); }

  /// Samples a patch bilinearly on this square around `centre`; `grid` maps the square's offsets to the patch's. All
  /// are in samples of the patch, from its middle. False if a corner of the square lies outside.
  bool sample(const PaddedPatch& patch, const Eigen::Vector2f& centre, const Eigen::Matrix2f& grid,
              Samples& values) const;

  /// The same with the patch's own grid, and the derivatives by x and y: half of the difference between both
  /// neighbours, which must not lie outside either.
  bool sampleUpright(const PaddedPatch& patch, const Eigen::Vector2f& centre, Samples& values, Samples& by_x,
                     Samples& by_y) const;

 private:
  Samples x_{}, y_{}, mask_{};  ///< offset of each pixel from the square's middle; one for each pixel
};

}  // namespace sdvo
