#pragma once

#include <Eigen/Core>
#include <vector>

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

  /// The last pair's motion is confirmed, so that its change is this rig's way.
  void learn();

  /// rad; NaN before the first pair with features.
  Eigen::Vector3d rotation() const;
  /// Standard deviation, rad; NaN as above. Errors within a part of the image are alike, in all pairs.
  Eigen::Vector3d sigma() const;

 private:
  /// In units of the residuals, 1/px^2.
  struct Sums {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double weight = 0.0, curvature = 0.0;  ///< derivatives of the residuals' costs: first by residual, second

    void add(const Eigen::RowVector3d& row, double dv, const Eigen::Vector3d& estimate);
    void forget();
    Eigen::Matrix3d covariance() const;  ///< if the errors were independent, of 1 px
    Eigen::Vector3d rotation() const { return covariance() * gradient; }
  };
  /// Of one pair, whose wrong matches have no weight.
  Sums sumUp(const StereoFeatures& features) const;
  void remember(const StereoFeatures& features, const Eigen::Vector3d& estimate);

  /// Difference of two rotations as a shift of the rows of `now`, px, root mean square.
  static double distance(const Sums& now, const Sums& before);

  /// How large a rig's changes are as a rule.
  struct Change {
    double last = 0.0;    ///< px
    double square = 0.0;  ///< of those of confirmed pairs, px^2

    double timesUsual() const;
    void learn();
  };

  Sums sums_, last_;         ///< of all pairs, and of the last one alone
  std::vector<Sums> parts_;  ///< of the image, of all pairs
  Change against_memory_, against_last_;
};

}  // namespace sdvo
