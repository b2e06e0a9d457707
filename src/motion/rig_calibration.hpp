#pragma once

#include <Eigen/Core>
#include <optional>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Misalignment of a stereo rig after rectification. Its disparities have a smooth error:
///   measured disparity = true disparity + offset + bend * x^2 + tilt * y.
/// (x, y) are normalised coordinates, ((u - cx) / fx, (v - cy) / fy).
/// The offset is the error in the centre, by a wrong convergence angle or principal point. The bend is how a rotation
/// of the right camera about the vertical axis changes the error towards the sides. The tilt is by a rotation about its
/// optical axis.
struct RigCalibration {
  static constexpr int kParameters = 3;
  using Vector = Eigen::Matrix<double, kParameters, 1>;  ///< (offset, bend, tilt), px
  using RowVector = Eigen::Matrix<double, 1, kParameters>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
  using MotionJacobian = Eigen::Matrix<double, 6, kParameters>;  ///< a motion's right perturbation by the parameters

  Vector value = Vector::Zero();

  /// Derivative of the disparity's error at (u, v) of the left image by the parameters.
  static RowVector shape(const StereoCamera& camera, double u, double v) {
    const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
    return {1.0, x * x, y};
  }
  double disparityError(const StereoCamera& camera, double u, double v) const { return shape(camera, u, v).dot(value); }
};

/// Estimate of the rig, whose effect on disparities is a RigCalibration: (offset, bend, roll, delay) in px, px, rad and
/// s. The roll is the right camera's about its optical axis. The delay is the time by which right images are taken
/// later than their stamps say.
struct RigEstimate {
  static constexpr int kParameters = 4, kRoll = 2, kDelay = 3;
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
  using MotionJacobian = Eigen::Matrix<double, 6, kParameters>;
  using CalibrationByRig = Eigen::Matrix<double, RigCalibration::kParameters, kParameters>;

  Vector mean = Vector::Zero();
  Matrix covariance = Matrix::Zero();

  double delay() const { return mean[kDelay]; }

  /// Derivative of the rig by a rotation of the right camera, rad about the axes of its optical frame. The one about x
  /// is left out: it changes disparities by f * x * y, and to estimate it improved no rendered rig (0.05 and 0.2
  /// degrees).
  static Eigen::Matrix<double, kParameters, 3> byRotation(const StereoCamera& camera) {
    Eigen::Matrix<double, kParameters, 3> by_rotation = Eigen::Matrix<double, kParameters, 3>::Zero();
    by_rotation(0, 1) = by_rotation(1, 1) = camera.fx;
    by_rotation(kRoll, 2) = 1.0;
    return by_rotation;
  }

  /// Derivative of the calibration that disparities show, px, by the rig. While the camera turns at `rate` (rad/s about
  /// its axes), a right camera that is late has rotated by that for each second of delay.
  static CalibrationByRig calibrationByRig(const StereoCamera& camera, const Eigen::Vector3d& rate) {
    CalibrationByRig by_rig = CalibrationByRig::Zero();
    by_rig(0, 0) = by_rig(1, 1) = 1.0;
    by_rig(2, kRoll) = -camera.fx;
    by_rig.col(kDelay) = by_rig * byRotation(camera) * rate;
    return by_rig;
  }

  /// The rig whose disparities err by a calibration, and whose right images are late by `delay`, s.
  static Vector of(const StereoCamera& camera, const RigCalibration& calibration, double delay) {
    return {calibration.value[0], calibration.value[1], -calibration.value[2] / camera.fx, delay};
  }
};

/// A normal distribution over the calibration in information form.
struct CalibrationBelief {
  RigCalibration::Vector mean = RigCalibration::Vector::Zero();                     ///< px
  RigCalibration::Matrix information = 1e-12 * RigCalibration::Matrix::Identity();  ///< 1/px^2
  /// Standard deviation, px, of the disparity error that it leaves at a point, equal in all of the point's sightings.
  /// None: not measured yet.
  std::optional<double> common_sigma = std::nullopt;
};

}  // namespace sdvo
