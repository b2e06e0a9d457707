#pragma once

#include <array>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"

namespace sdvo {

/// Splits the features of each pair in two halves without a common feature. A point that the flow follows stays in its
/// half: else both halves would lose most of their matches. New points are assigned by the fields of a chequerboard
/// over the image, so that neighbours, whose errors are correlated, are in one half.
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
