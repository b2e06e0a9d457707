#include "stereo_descriptor_vo/odometry/right_camera_rotation.hpp"

#include <Eigen/LU>
#include <limits>

namespace sdvo {
namespace {

constexpr double kMemory = 0.98;      // share of the past that a pair leaves: some fifty pairs
constexpr double kKernelScale = 0.5;  // px: a vertical disparity further off is a wrong match
constexpr double kPrior = 1e-3;       // keeps the first pairs' equations solvable, 1/px^2 at one radian
/// The same scene points are seen again in the next pairs, so that their errors average out much more slowly than those
/// of independent features.
constexpr double kCorrelatedSightings = 10.0;

Eigen::RowVector3d effect(const StereoCamera& camera, double u_right, double v) {
  const double x = (u_right - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  return camera.fy * Eigen::RowVector3d(1.0 + y * y, -x * y, -x);
}

}  // namespace

void RightCameraRotation::add(const StereoFeatures& features) {
  constexpr int kReweightings = 3;
  if (features.count() == 0) return;
  Eigen::Vector3d estimate = weight_ > 0.0 ? rotation() : Eigen::Vector3d::Zero();
  Eigen::Matrix3d information;
  Eigen::Vector3d gradient;
  double square = 0.0, weight = 0.0;
  for (int pass = 0; pass < kReweightings; ++pass) {
    information.setZero(), gradient.setZero();
    square = weight = 0.0;
    for (int i = 0; i < features.count(); ++i) {
      const Eigen::RowVector3d row = effect(features.camera, features.u[i] - features.disparity[i], features.v[i]);
      const double residual = features.dv[i] - row.dot(estimate);
      const double w = 1.0 / (1.0 + residual * residual / (kKernelScale * kKernelScale));
      information.noalias() += w * row.transpose() * row;
      gradient.noalias() += w * row.transpose() * features.dv[i];
      square += w * residual * residual;
      weight += w;
    }
    const Eigen::Matrix3d total = kMemory * information_ + information + kPrior * Eigen::Matrix3d::Identity();
    estimate = total.inverse() * (kMemory * gradient_ + gradient);
  }
  information_ = kMemory * information_ + information;
  gradient_ = kMemory * gradient_ + gradient;
  square_ = kMemory * square_ + square;
  weight_ = kMemory * weight_ + weight;
}

Eigen::Vector3d RightCameraRotation::rotation() const {
  if (weight_ <= 0.0) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return (information_ + kPrior * Eigen::Matrix3d::Identity()).inverse() * gradient_;
}

Eigen::Vector3d RightCameraRotation::sigma() const {
  if (weight_ <= 0.0) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Matrix3d covariance = (information_ + kPrior * Eigen::Matrix3d::Identity()).inverse();
  return (kCorrelatedSightings * square_ / weight_ * covariance.diagonal()).cwiseSqrt();
}

}  // namespace sdvo
