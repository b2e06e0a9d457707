#pragma once

#include <Eigen/Geometry>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// By how much a camera's mount on TF is tilted, from the motions of a base that drives on a floor: it moves along the
/// floor and turns about its normal, on ramps, too. With a wrong mount it climbs or banks all the way.
class MountTilt {
 public:
  /// The floor's normal is (x, y, 1) in the axes of the base.
  struct Estimate {
    Eigen::Vector2d normal;      ///< x ahead: negative, the camera is pitched down by more than on TF
    Eigen::Matrix2d covariance;  ///< rad^2
  };

  explicit MountTilt(const PlanarOptions& options);

  /// `T_previous_current`: of the camera since the pair before. Another mount begins anew.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_previous_current);

  /// `sigma`: rad, of each tilt as the mount is trusted beforehand.
  Estimate estimate(double sigma) const;

  /// Covariance of a pose (of a right perturbation of T_origin_camera) by the mount's error alone. With it the base's
  /// first pose is tilted, and the way with it. This is the second moment of the tilt by the motions and, where the
  /// pose is on the first one's floor, by its height.
  Matrix6d ofPose(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_origin_camera,
                  bool is_on_floor) const;

  const Eigen::Isometry3d& mount() const { return T_base_camera_; }
  double distance() const { return distance_; }  ///< m

 private:
  /// Sums of squares and products of motions.
  struct Sums {
    Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
    Eigen::Vector2d product = Eigen::Vector2d::Zero();
    double rest = 0.0;
    int count = 0;

    void add(const Eigen::Vector2d& row, double value);
    double variance(const Eigen::Vector2d& normal) const;
  };

  /// With what is known of the normal besides: information and its product with the mean.
  Estimate solve(const Eigen::Matrix2d& information, const Eigen::Vector2d& product) const;

  double height_sigma_, tilt_sigma_;  ///< m, rad
  Eigen::Isometry3d T_base_camera_ = Eigen::Isometry3d::Identity();
  Sums translations_, rotations_;  ///< m, rad
  double distance_ = 0.0;
};

}  // namespace sdvo
