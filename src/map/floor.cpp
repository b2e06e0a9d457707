#include "floor.hpp"

#include <Eigen/Cholesky>
#include <opencv2/core.hpp>

#include "../common/text.hpp"
#include "../motion/motion_refinement.hpp"

namespace sdvo {
namespace {

constexpr double kKernelSquare = noiseGate(1);  // of Cauchy's kernel, in standard deviations

}  // namespace

Floor::Floor(const PlanarOptions& options, const Eigen::Isometry3d& T_base_from_camera, double height_of_base)
    : T_base_camera(T_base_from_camera), height(height_of_base) {
  const double tilt = options.planar_tilt_sigma * CV_PI / 180.0;
  sigma = {options.planar_height_sigma, tilt, tilt};
}

Eigen::Isometry3d Floor::base(const Eigen::Isometry3d& T_camera_origin) const {
  return T_base_camera * T_camera_origin.inverse() * T_base_camera.inverse();
}

Eigen::Vector3d Floor::residual(const Eigen::Isometry3d& T_camera_origin, Jacobian* jacobian) const {
  const Eigen::Isometry3d T_floor_base = base(T_camera_origin);
  const Eigen::Matrix3d& R = T_floor_base.linear();
  const Eigen::Vector3d weights = sigma.cwiseInverse();
  if (jacobian) {
    // exp(xi) T_camera_origin makes it T_floor_base exp(-Ad(T_base_camera) xi). A rotation eta of the base changes its
    // z axis by R (eta x z).
    Jacobian by_base = Jacobian::Zero();
    by_base.block<1, 3>(0, 0) = R.row(2);
    by_base.block<2, 1>(1, 3) = -R.block<2, 1>(0, 1);
    by_base.block<2, 1>(1, 4) = R.block<2, 1>(0, 0);
    *jacobian = weights.asDiagonal() * by_base * -adjoint(T_base_camera);
  }
  return weights.cwiseProduct(Eigen::Vector3d(T_floor_base.translation().z() - height, R(0, 2), R(1, 2)));
}

double Floor::cost(double square) {
  return kKernelSquare * std::log1p(square / kKernelSquare);
}

double Floor::weight(double square) {
  return cauchyWeight(square / kKernelSquare);
}

Eigen::Matrix<double, 6, 3> Floor::gain(const Jacobian& jacobian, const Matrix6d& covariance) const {
  const Eigen::Matrix3d innovation_covariance =
      jacobian * covariance * jacobian.transpose() + Eigen::Matrix3d::Identity();
  return innovation_covariance.ldlt().solve(jacobian * covariance).transpose();
}

Eigen::Isometry3d Floor::settled(const Eigen::Isometry3d& T_camera_origin, const Matrix6d& covariance) const {
  Jacobian jacobian;
  const Eigen::Vector3d found = residual(T_camera_origin, &jacobian);
  if (!isOn(found)) return T_camera_origin;
  const Eigen::Isometry3d T_origin_camera = T_camera_origin.inverse();
  // The window's poses have met this floor already: the covariance is that after it.
  const Vector6d step = gain(jacobian, constrained(T_origin_camera, covariance)) * found;
  return expSE3(-step) * T_camera_origin;
}

Matrix6d Floor::constrained(const Eigen::Isometry3d& T_origin_camera, const Matrix6d& covariance) const {
  Jacobian by_left;
  residual(T_origin_camera.inverse(), &by_left);
  // The inverse of T_origin_camera exp(xi) is exp(-xi) T_camera_origin. The sign cancels in a covariance.
  const Matrix6d left = covariance - gain(by_left, covariance) * by_left * covariance;
  return 0.5 * (left + left.transpose());
}

Matrix6d FloorBelief::covariance(const Floor& known, const Eigen::Isometry3d& T_origin_camera,
                                 const Matrix6d& of_pose) const {
  const Matrix6d with_floor = on_floor_ ? known.constrained(T_origin_camera, of_pose) : of_pose;
  return with_floor + mount_.ofPose(known.T_base_camera, T_origin_camera, on_floor_ && height_ == 0.0);
}

std::string FloorBelief::note(const Floor& known, const Eigen::Isometry3d& T_camera_origin,
                              const Eigen::Isometry3d& T_previous_current) {
  mount_.add(known.T_base_camera, T_previous_current);
  constexpr int kLevel = 10;  // pairs that make another floor (chosen: a second at 10 Hz)
  const Eigen::Vector3d residual = known.residual(T_camera_origin);
  const double height = known.base(T_camera_origin).translation().z();
  const bool is_tilted = !Floor::isLevel(residual);
  on_floor_ = Floor::isOn(residual);
  level_pairs_ = on_floor_ || is_tilted ? 0 : level_pairs_ + 1;
  std::string reason;
  if (is_tilted)
    reason = text(1, "off the floor: tilted by ",
                  residual.tail<2>().cwiseProduct(known.sigma.tail<2>()).norm() * 180.0 / CV_PI, " degrees, a ramp?");
  else if (!on_floor_)
    reason = text(2, "off the floor: ", height - height_, " m above it");
  if (level_pairs_ >= kLevel) {
    reason += ", level: this is the floor from now on";
    height_ = height;
    level_pairs_ = 0;
  }
  return reason;
}

}  // namespace sdvo
