#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "right_rotation.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// How much lower a rig shows points in its right image (dv, px), as a rule, in each part of the image. Rectification
/// leaves errors that last at their place. So a pair speaks of a change only by its difference from this pattern.
class RowPattern {
 public:
  /// `memory`: ratio of the past that a pair leaves.
  explicit RowPattern(double memory) : memory_(memory) {}

  void learn(const StereoFeatures& features);

  /// dv of a feature beyond what is usual in its part, px; dv itself where nothing is known.
  double change(const StereoFeatures& features, int i) const;

  /// The rotation of the right camera that all parts of the pattern have in common; none where too few are known.
  std::optional<RightRotation> rotation() const;
  /// Of a pair against the pattern. None where too few parts of it are known.
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
