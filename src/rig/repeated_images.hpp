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

  /// Repetitions in a row up to the last pair.
  int inARow() const { return in_a_row_; }

  /// Whether the last two pairs that repeated the one before did so once each: the driver sends each pair twice.
  bool comeTwice() const { return in_a_row_ == 0 && single_ >= 2; }

  /// Log-odds that images which repeat are old ones, before anything is known of the motion. Images with noise never
  /// repeat by themselves; those of a simulator without noise do whenever it stands. Until the camera stood for some
  /// pairs, a stop and a driver at fault are equally likely.
  double logOddsOfOld() const;

  /// `stood`: no significant motion was measured since the pair before.
  void remember(const StereoFeatures& features, bool stood);

 private:
  std::vector<bool> repeated(const StereoFeatures& features) const;

  std::array<std::vector<float>, 3> features_;  ///< u, v and disparity of the last pair's features, px
  int in_a_row_ = 0;                            ///< repetitions up to the last pair
  int single_ = 0;                              ///< repetitions that came alone, every second pair
  int still_ = 0;                               ///< pairs in a row that stood and did not repeat as a whole
  std::optional<bool> have_noise_;              ///< known once the camera stood
};

}  // namespace sdvo
