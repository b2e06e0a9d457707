#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Recognises a camera that repeats its images while it moves, which would look like a standstill.
class RepeatedImages {
 public:
  /// Whether the pair shows what the one before did although the camera moved between them. `T_previous_current` is how
  /// it should have moved, if that is known: most points by more than `noise`, px. `is_measured`: by something else
  /// than the images; a prediction is believed less, so that images which were frozen remain so until they change.
  bool areFrozen(const StereoFeatures& features, double noise,
                 const std::optional<Eigen::Isometry3d>& T_previous_current, bool is_measured) const;

  /// Rows of the features whose part of the image is new. From some row of a torn image on, or up to it, the left image
  /// is still that of the pair before: features stand where they stood, to the digit.
  std::vector<int> newRows(const StereoFeatures& features) const;

  /// Takes note of the pair and of what was said of it.
  void remember(const StereoFeatures& features, bool frozen);

 private:
  std::array<std::vector<float>, 3> features_;  ///< u, v and disparity of the last pair's features, px
  bool frozen_ = false;
};

}  // namespace sdvo
