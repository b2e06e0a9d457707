#pragma once

#include <Eigen/Geometry>

#include "finding.hpp"

namespace sdvo {

/// Whether a base that drives on a floor moves along it and turns about its normal, as the camera's mount on TF has
/// them. On ramps, too: the base is tilted with them. A camera that is pitched or rolled otherwise makes a base that
/// climbs or banks all the way.
class MountCheck {
 public:
  /// `T_before_now`: of the camera since the pair before. Another mount begins anew.
  void add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_before_now);

  /// `tilt_sigma`: deg, as the mount is trusted beforehand.
  Finding judge(double tilt_sigma) const;

 private:
  /// The floor's normal is (a, b, 1) on the base: sums of squares and products of its motions.
  struct Sums {
    Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
    Eigen::Vector2d product = Eigen::Vector2d::Zero();
    double rest = 0.0;
    int count = 0;

    void add(const Eigen::Vector2d& row, double value);
    double variance(const Eigen::Vector2d& tilt) const;
  };

  Eigen::Isometry3d T_base_camera_ = Eigen::Isometry3d::Identity();
  Sums translations_, rotations_;  ///< m, rad
  double distance_ = 0.0;          ///< m
};

}  // namespace sdvo
