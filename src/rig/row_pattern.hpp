#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "right_rotation.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Mean dv (v_right - v_left, px) of a rig in each part of the image. Rectification leaves constant errors in each
/// part, so only a change against this pattern is evidence of a changed rig.
class RowPattern {
 public:
  /// `memory`: factor on the weight of previous pairs with each new pair.
  explicit RowPattern(double memory) : memory_(memory) {}

  void learn(const StereoFeatures& features);

  /// Difference of feature `i` in dv from the mean of its part, px; dv itself in a part without a mean.
  double change(const StereoFeatures& features, int i) const;

  /// Rotation of the right camera that fits the mean rows; none if too few parts have a mean.
  std::optional<RightRotation> rotation() const;
  /// Rotation that fits a pair's differences from the mean rows; none if too few parts have both.
  std::optional<RightRotation> change(const StereoFeatures& features) const;

 private:
  struct Part {
    double weight = 0.0, dv = 0.0;                           ///< number of features; mean or median, px
    Eigen::RowVector3d effect = Eigen::RowVector3d::Zero();  ///< mean derivative of dv by the rotation, px/rad
  };
  using Parts = std::array<Part, RowDelay::kParts>;
  static Parts partsOf(const StereoFeatures& features);
  static std::optional<RightRotation> fit(const Parts& parts);

  double memory_;
  Parts parts_;
};

}  // namespace sdvo
