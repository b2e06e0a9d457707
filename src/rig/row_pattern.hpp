#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "right_rotation.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Mean dv (v_right - v_left, px) of a rig in each part of the image. Rectification leaves constant errors in each
/// part, so only a change against this pattern is evidence of a changed rig. Remembers as many pairs as RowDelay.
class RowPattern {
 public:
  /// `rows`: of the pair's inliers, whose velocities the mean rows may depend on.
  void learn(const StereoFeatures& features, const std::vector<RowMotion>& rows = {});

  /// Whether the mean rows follow the mean velocities as those of right images that are another pair's, `dt` s apart.
  bool isOfOtherPairs(double dt) const;

  /// Difference of feature `i` in dv from the mean of its part, px; dv itself in a part without a mean.
  double change(const StereoFeatures& features, int i) const;

  /// Rotation of the right camera that fits the mean rows; none if too few parts have a mean.
  std::optional<RightRotation> rotation() const;
  /// Rotation that fits a pair's differences from the mean rows; none if too few parts have both.
  std::optional<RightRotation> change(const StereoFeatures& features) const;

 private:
  struct Part {
    double weight = 0.0, dv = 0.0;                           ///< number of features; mean or median, px
    double velocity = 0.0;                                   ///< mean, down in the left image, px/s
    Eigen::RowVector3d effect = Eigen::RowVector3d::Zero();  ///< mean derivative of dv by the rotation, px/rad
  };
  using Parts = std::array<Part, RowDelay::kParts>;
  static Parts partsOf(const StereoFeatures& features);
  static std::optional<RightRotation> fit(const Parts& parts);

  Parts parts_;
};

}  // namespace sdvo
