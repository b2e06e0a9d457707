#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "right_rotation.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Mean dv (v_right - v_left, px) of a rig in each part of the image. Rectification leaves errors that stay in their
/// part. Hence the rig changed only if a pair differs from this pattern.
class RowPattern {
 public:
  /// `memory`: ratio of the past that a pair leaves.
  explicit RowPattern(double memory) : memory_(memory) {}

  void learn(const StereoFeatures& features);

  /// dv of a feature less the mean of its part, px; dv itself in a part without a mean.
  double change(const StereoFeatures& features, int i) const;

  /// The rotation of the right camera that fits the pattern best; none if too few parts have a mean.
  std::optional<RightRotation> rotation() const;
  /// The rotation that fits the differences of a pair from the pattern best; none if too few parts have both.
  std::optional<RightRotation> change(const StereoFeatures& features) const;

 private:
  struct Part {
    double weight = 0.0, dv = 0.0;                           ///< number of features; mean, px
    Eigen::RowVector3d effect = Eigen::RowVector3d::Zero();  ///< mean derivative of dv by the rotation, px/rad
  };
  using Parts = std::array<Part, RowDelay::kParts>;
  static Parts partsOf(const StereoFeatures& features);
  static std::optional<RightRotation> fit(const Parts& parts);

  double memory_;
  Parts parts_;
};

}  // namespace sdvo
