#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Detects images, or rows of them, that repeat the previous pair: their features stand still even if the camera moves.
class RepeatedImages {
 public:
  /// Whether all features equal those of the previous pair exactly.
  bool repeat(const StereoFeatures& features) const;

  /// Whether a motion would have moved more than half of the features by more than `noise`, px.
  static bool shouldHaveMoved(const StereoFeatures& features, double noise,
                              const Eigen::Isometry3d& T_previous_current);

  /// Indices of features outside of repeated rows. A torn left image shows the previous one above or below some row.
  /// Features there have exactly a previous position, although the expected motion `T_previous_current` moves them by
  /// more than `noise`, px. Without an expected motion or a significant tear these are all features.
  std::vector<int> newFeatures(const StereoFeatures& features, double noise,
                               const std::optional<Eigen::Isometry3d>& T_previous_current) const;

  /// Number of successive repeated pairs up to the last one.
  int inARow() const { return in_a_row_; }

  /// Whether the driver sends each pair twice: the last two repetitions were single ones, followed by a new pair.
  bool comeTwice() const { return in_a_row_ == 0 && single_ >= 2; }

  /// Log-odds that repeated images are old ones, before the motion is considered. Images with noise repeat by a fault
  /// only, a simulator's without noise whenever the camera stands. Which they are is known once the camera has stood
  /// for some pairs; until then their noise tells, grey levels. Compression hides it, so little noise says nothing.
  double logOddsOfOld(double noise) const;

  /// Stores a pair. `stood`: whether its motion since the previous pair is not significant; none if no motion is
  /// confirmed.
  void remember(const StereoFeatures& features, std::optional<bool> stood);

 private:
  std::vector<bool> repeated(const StereoFeatures& features) const;

  std::array<std::vector<float>, 3> features_;  ///< u, v and disparity of the last pair's features, px
  int in_a_row_ = 0;                            ///< see inARow()
  int single_ = 0;                              ///< successive single repetitions, see comeTwice()
  int still_ = 0;                               ///< successive pairs that stood and differ from the previous one
  int still_repeats_ = 0;                       ///< successive pairs that stood and repeat the previous one
  std::optional<bool> have_noise_;              ///< none until the camera has stood
};

}  // namespace sdvo
