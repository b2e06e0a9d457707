#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Recognises images, and parts of them, that repeat those of the pair before. Where the camera moved between the two
/// they show nothing of it.
class RepeatedImages {
 public:
  /// Whether the pair shows what the one before did, to the digit.
  bool repeat(const StereoFeatures& features) const;

  /// Whether a motion would have moved most features by more than `noise`, px.
  static bool shouldHaveMoved(const StereoFeatures& features, double noise,
                              const Eigen::Isometry3d& T_previous_current);

  /// Indices of the features whose part of the image is new, with the motion that is expected. From some row of a torn
  /// image on, or up to it, the left image is still that of the pair before. There features stand where they stood, to
  /// the digit, although they should have moved by more than `noise`, px.
  std::vector<int> newFeatures(const StereoFeatures& features, double noise,
                               const std::optional<Eigen::Isometry3d>& T_previous_current) const;

  /// Repetitions up to the last pair.
  int inARow() const { return in_a_row_; }

  /// Whether the last two pairs that repeated the one before did so once each: the driver sends each pair twice.
  bool comeTwice() const { return in_a_row_ == 0 && single_ >= 2; }

  /// Whether the camera stood for some pairs, and none repeated the one before: its images have noise, so that those
  /// which repeat are no new ones.
  bool haveNoise() const { return have_noise_; }

  /// `stood`: no significant motion was measured since the pair before.
  void remember(const StereoFeatures& features, bool stood);

 private:
  std::array<std::vector<float>, 3> features_;  ///< u, v and disparity of the last pair's features, px
  int in_a_row_ = 0;                            ///< repetitions up to the last pair
  int single_ = 0;                              ///< repetitions that came alone, every second pair
  int still_ = 0;                               ///< pairs in a row that stood and did not repeat
  bool have_noise_ = false;
};

}  // namespace sdvo
