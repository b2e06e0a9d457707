#include "stereo_descriptor_vo/rig/right_camera_rotation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/rig/row_delay.hpp"

namespace sdvo {
namespace {

Eigen::RowVector3d effect(const StereoFeatures& features, int i) {
  const StereoCamera& camera = features.camera;
  const double x = (features.u[i] - features.disparity[i] - camera.cx) / camera.fx;
  const double y = (features.v[i] - camera.cy) / camera.fy;
  return camera.fy * Eigen::RowVector3d(1.0 + y * y, -x * y, -x);
}

Eigen::Vector3d unknown() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

RightCameraRotation::Sums RightCameraRotation::sumUp(const StereoFeatures& features) const {
  constexpr int kReweightings = 3;
  Eigen::Vector3d estimate = sums_.rotation();
  Sums sums;
  for (int pass = 0; pass < kReweightings; ++pass) {
    sums = Sums();
    for (int i = 0; i < features.count(); ++i) sums.add(effect(features, i), features.dv[i], estimate);
    estimate = sums.rotation();
  }
  return sums;
}

/// `estimate`: of what is known, for the weights.
void RightCameraRotation::remember(const StereoFeatures& features, const Eigen::Vector3d& estimate) {
  const auto last = [](int size) { return std::floor(size / kPart); };
  const double columns = last(features.camera.width), rows = last(features.camera.height);
  parts_.resize(static_cast<std::size_t>((columns + 1.0) * (rows + 1.0)));
  sums_.forget();
  for (Sums& part : parts_) part.forget();
  for (int i = 0; i < features.count(); ++i) {
    // Clamped before it becomes an integer, which a position far outside of the image overflows.
    const double column = std::clamp(std::floor(features.u[i] / kPart), 0.0, columns);
    const double row = std::clamp(std::floor(features.v[i] / kPart), 0.0, rows);
    for (Sums* sums : {&sums_, &parts_[static_cast<std::size_t>(row * (columns + 1.0) + column)]})
      sums->add(effect(features, i), features.dv[i], estimate);
  }
}

double RightCameraRotation::add(const StereoFeatures& features) {
  if (features.count() == 0) return 0.0;
  // A camera that turned disagrees with the memory. Back in its place it agrees again, but not with the pair before.
  against_memory_.last = against_last_.last = 0.0;
  if (features.count() >= kFewestMeasured) {
    const Sums now = sumUp(features);
    against_memory_.last = distance(now, sums_);
    against_last_.last = distance(now, last_);
    last_ = now;
  }
  remember(features, (sums_.weight > 0.0 ? sums_ : last_).rotation());
  return std::max(against_memory_.timesUsual(), against_last_.timesUsual());
}

void RightCameraRotation::learn() {
  against_memory_.learn();
  against_last_.learn();
}

double RightCameraRotation::Change::timesUsual() const {
  constexpr double kUsualOfRigs = 0.2;  // px: undisturbed, KITTI's and EuRoC's rigs change by less
  return last / std::max(kUsualOfRigs, std::sqrt(square));
}

/// They are large where rectification left more than a rotation (Karlsruhe's rig: 0.5 px).
void RightCameraRotation::Change::learn() {
  square += (1.0 - kUsualMemory) * (last * last - square);
}

double RightCameraRotation::distance(const Sums& now, const Sums& before) {
  if (now.weight <= 0.0 || before.weight <= 0.0) return 0.0;
  const Eigen::Vector3d change = now.rotation() - before.rotation();
  return std::sqrt(change.dot(now.information * change) / now.weight);
}

void RightCameraRotation::Sums::add(const Eigen::RowVector3d& row, double dv, const Eigen::Vector3d& estimate) {
  const double residual = (dv - row.dot(estimate)) / RowDelay::kKernel, w = 1.0 / (1.0 + residual * residual);
  information.noalias() += w * row.transpose() * row;
  gradient.noalias() += w * dv * row.transpose();
  weight += w, curvature += w * (2.0 * w - 1.0);
}

void RightCameraRotation::Sums::forget() {
  for (double* sum : {&weight, &curvature}) *sum *= RowDelay::kMemory;
  information *= RowDelay::kMemory, gradient *= RowDelay::kMemory;
}

Eigen::Matrix3d RightCameraRotation::Sums::covariance() const {
  constexpr double kPrior = 1e-3;  // keeps the first pairs' equations solvable, 1/px^2 at one radian
  return (information + kPrior * Eigen::Matrix3d::Identity()).inverse();
}

Eigen::Vector3d RightCameraRotation::rotation() const {
  return sums_.weight > 0.0 ? sums_.rotation() : unknown();
}

Eigen::Vector3d RightCameraRotation::sigma() const {
  if (sums_.weight <= 0.0) return unknown();
  const Eigen::Vector3d rotation = sums_.rotation();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Sums& part : parts_) {
    const Eigen::Vector3d rest = part.gradient - part.information * rotation;
    spread.noalias() += rest * rest.transpose();
  }
  const Eigen::Matrix3d covariance = sums_.weight / std::max(sums_.curvature, 0.0) * sums_.covariance();
  return (covariance * spread * covariance).diagonal().cwiseSqrt();
}

}  // namespace sdvo
