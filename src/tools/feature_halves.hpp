#pragma once

#include <array>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// Splits the features of each pair in two halves that share none. A point stays in its half from pair to pair, as far
/// as the flow follows it: else either half would lose most of its matches. A new point takes the half of its field of
/// a chequered pattern over the image, so neighbours, whose errors are alike, are together.
class FeatureHalves {
 public:
  /// Indices of both halves' features of the next pair. `flow`: its matches by an odometry on all features.
  std::array<std::vector<int>, 2> split(const StereoFeatures& features, const std::vector<FeatureFlow>& flow);

 private:
  int halfOfPrevious(float u, float v) const;

  std::vector<float> u_, v_;  ///< of the previous pair's features, px
  std::vector<int> half_;     ///< 0 or 1 for each of them
};

}  // namespace sdvo
