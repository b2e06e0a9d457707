#pragma once

#include <Eigen/Geometry>
#include <string>

#include "../motion/noise.hpp"
#include "mount_tilt.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// The floor that a base drives on: the plane z = height in the frame of the base's first pose.
struct Floor {
  using Jacobian = Eigen::Matrix<double, 3, 6>;

  Eigen::Isometry3d T_base_camera;
  double height = 0.0;                              ///< m
  Eigen::Vector3d sigma = Eigen::Vector3d::Ones();  ///< of height (m) and of the two tilts (rad)

  Floor(const PlanarOptions& options, const Eigen::Isometry3d& T_base_camera, double height);

  /// T_floor_base for the pose of a camera. T_camera_origin has the first left camera as its origin.
  Eigen::Isometry3d base(const Eigen::Isometry3d& T_camera_origin) const;

  /// Height over the floor and two tilts of the base, in standard deviations, and their derivatives by the left
  /// perturbation of T_camera_origin.
  Eigen::Vector3d residual(const Eigen::Isometry3d& T_camera_origin, Jacobian* jacobian = nullptr) const;

  /// Cauchy's kernel of one squared residual, and its weight: a robust one, so that a ramp is not forced to be level.
  static double cost(double square);
  static double weight(double square);

  /// Whether a base with this residual is level, and whether it also has the floor's height.
  static bool isLevel(const Eigen::Vector3d& residual) { return residual.tail<2>().squaredNorm() <= noiseGate(2); }
  static bool isOn(const Eigen::Vector3d& residual) {
    return isLevel(residual) && residual[0] * residual[0] <= noiseGate(1);
  }

  /// T_camera_origin moved towards the floor by one Kalman step; unchanged where the base is off the floor. The
  /// covariance is of a right perturbation of T_origin_camera.
  Eigen::Isometry3d settled(const Eigen::Isometry3d& T_camera_origin, const Matrix6d& covariance) const;

  /// Covariance of a pose (of a right perturbation of T_origin_camera) after the constraint to this floor.
  Matrix6d constrained(const Eigen::Isometry3d& T_origin_camera, const Matrix6d& covariance) const;

 private:
  /// Kalman gain: from the three residuals to the perturbation of the pose that `covariance` is of.
  Eigen::Matrix<double, 6, 3> gain(const Jacobian& jacobian, const Matrix6d& covariance) const;
};

/// Which floor a planar base is on: a ramp leads to another one.
class FloorBelief {
 public:
  explicit FloorBelief(const PlanarOptions& options) : mount_(options) {}

  double height() const { return height_; }  ///< m, in the axes of the base's first pose

  /// Updates the belief by a pose and the motion that led there; `known` is the floor at height(). Returns words if the
  /// base is off the floor: by how much, and whether its height is the floor from now on. Otherwise an empty string.
  std::string note(const Floor& known, const Eigen::Isometry3d& T_camera_origin,
                   const Eigen::Isometry3d& T_previous_current);

  /// Covariance of a pose, given without a floor, by what is believed of the floor and of the mount.
  Matrix6d covariance(const Floor& known, const Eigen::Isometry3d& T_origin_camera, const Matrix6d& of_pose) const;

 private:
  double height_ = 0.0;
  MountTilt mount_;
  bool on_floor_ = true;  ///< at the last pose
  int level_pairs_ = 0;   ///< consecutive ones, level and at another height
};

}  // namespace sdvo
