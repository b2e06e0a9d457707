#pragma once

#include <Eigen/Core>
#include <optional>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo {

/// Misalignment of a stereo rig after rectification, as an error of its disparities that varies smoothly over the
/// image:
///   measured disparity = true disparity + offset + bend * x^2,  x = (u - cx) / fx.
/// The offset is the error in the centre, by a wrong convergence angle or principal point. The bend is how a rotation
/// of the right camera about the vertical axis changes the error towards the sides.
struct RigCalibration {
  static constexpr int kParameters = 2;
  using Vector = Eigen::Matrix<double, kParameters, 1>;  ///< (offset, bend), px
  using RowVector = Eigen::Matrix<double, 1, kParameters>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
  using MotionJacobian = Eigen::Matrix<double, 6, kParameters>;  ///< a motion's right perturbation by the parameters

  Vector value = Vector::Zero();

  /// Derivative of the disparity's error at column u of the left image by the parameters.
  static RowVector shape(const StereoCamera& camera, double u) {
    const double x = (u - camera.cx) / camera.fx;
    return {1.0, x * x};
  }
  double disparityError(const StereoCamera& camera, double u) const { return shape(camera, u).dot(value); }
};

/// Estimate of the rig: (offset, bend, delay) in px, px, s. The delay is the time by which right images are taken
/// later than their stamps say.
struct RigEstimate {
  static constexpr int kParameters = RigCalibration::kParameters + 1, kDelay = RigCalibration::kParameters;
  using Vector = Eigen::Matrix<double, kParameters, 1>;
  using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
  using MotionJacobian = Eigen::Matrix<double, 6, kParameters>;
  using Shape = Eigen::Matrix<double, RigCalibration::kParameters, kParameters>;

  Vector mean = Vector::Zero();
  Matrix covariance = Matrix::Zero();

  double delay() const { return mean[kDelay]; }

  /// Derivative of the calibration that disparities show, px, by the rig. While the camera turns to the right at `yaw`
  /// rad/s, a late right image has moved by f * yaw * (1 + x^2) to the left for each second of delay.
  static Shape shape(const StereoCamera& camera, double yaw) {
    const double late = camera.fx * yaw;
    Shape shape;
    shape << 1.0, 0.0, late,  //
        0.0, 1.0, late;
    return shape;
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
