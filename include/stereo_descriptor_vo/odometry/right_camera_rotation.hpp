#pragma once

#include <Eigen/Core>

#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Rotation of the right camera that rectification left behind, from the vertical disparities of all features. A small
/// rotation w (rad, about the axes of the left optical frame) moves the right view vertically. With x and y as
/// normalised coordinates in the right image it is:
///   dv = f * (w_x * (1 + y^2) - w_z * x - w_y * x * y).
/// It is reported, so that a rig in need of calibration is noticed. A pair that contradicts it is doubted. The motion
/// is measured with rows of the left view alone and does not depend on it.
class RightCameraRotation {
 public:
  /// Takes in one pair; old pairs are forgotten slowly. Returns by how many times what is usual the camera turned
  /// before it: usual on rigs, and on this one.
  double add(const StereoFeatures& features);

  /// rad; NaN before the first pair with features.
  Eigen::Vector3d rotation() const;
  /// Standard deviation, rad; NaN as above.
  Eigen::Vector3d sigma() const;

 private:
  struct Sums {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< in units of the residuals, 1/px^2
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double square = 0.0;  ///< weighted sum of squared residuals, px^2
    double weight = 0.0;

    Eigen::Vector3d rotation() const;
  };
  /// Those of the past and of one pair, whose wrong matches have no weight.
  Sums sumUp(const StereoFeatures& features, const Sums& past) const;

  /// Difference of two rotations as a shift of the rows of `now`, px, root mean square.
  static double distance(const Sums& now, const Sums& before);

  /// Learns how large a rig's changes are as a rule.
  struct UsualChange {
    double square = 0.0;  ///< of the changes of the last pairs, px^2

    /// Takes in a change (px) and returns how many times the usual one it is. `memory_of_large`: ratio of the square
    /// that a large change leaves.
    double exceededBy(double change, double memory_of_large);
  };

  Sums sums_, last_;  ///< of all pairs, and of the last one alone
  UsualChange against_memory_, against_last_;
};

}  // namespace sdvo
