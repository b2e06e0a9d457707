#include "stereo_descriptor_vo/odometry/right_camera_rotation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stereo_descriptor_vo/odometry/noise.hpp"
#include "stereo_descriptor_vo/odometry/row_delay.hpp"

namespace sdvo {
namespace {

constexpr double kMemory = 0.98;  // share of the past that a pair leaves: some fifty pairs (chosen)
constexpr double kPrior = 1e-3;   // keeps the first pairs' equations solvable, 1/px^2 at one radian
/// The same scene points are seen again in the next pairs, so that their errors average out much more slowly than those
/// of independent features.
constexpr double kCorrelatedSightings = 10.0;

// A turn of the camera.
constexpr double kUsualOfRigs = 0.2;  // px: undisturbed, KITTI's and EuRoC's rigs change by less
constexpr double kUnusual =
    3.0;  // times the usual change (chosen). That grows where rectification left more than a rotation
          // (Karlsruhe's rig: 0.5 px), or where the shutters are apart while the camera turns.

Eigen::RowVector3d effect(const StereoCamera& camera, double u_right, double v) {
  const double x = (u_right - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  return camera.fy * Eigen::RowVector3d(1.0 + y * y, -x * y, -x);
}

}  // namespace

RightCameraRotation::Sums RightCameraRotation::sumUp(const StereoFeatures& features, const Sums& past) const {
  constexpr int kReweightings = 3;
  Eigen::Vector3d estimate = sums_.weight > 0.0 ? rotation() : Eigen::Vector3d::Zero();
  Sums sums;
  for (int pass = 0; pass < kReweightings; ++pass) {
    sums = past;
    for (int i = 0; i < features.count(); ++i) {
      const Eigen::RowVector3d row = effect(features.camera, features.u[i] - features.disparity[i], features.v[i]);
      const double residual = features.dv[i] - row.dot(estimate);
      const double w = 1.0 / (1.0 + residual * residual / (RowDelay::kKernel * RowDelay::kKernel));
      sums.information.noalias() += w * row.transpose() * row;
      sums.gradient.noalias() += w * row.transpose() * features.dv[i];
      sums.square += w * residual * residual;
      sums.weight += w;
    }
    estimate = sums.rotation();
  }
  return sums;
}

double RightCameraRotation::add(const StereoFeatures& features) {
  if (features.count() == 0) return 0.0;
  // A camera that turned disagrees with the memory. Back in its place it agrees again, but not with the pair before.
  double turned = 0.0;
  if (features.count() >= kFewestMeasured) {
    const Sums now = sumUp(features, {});
    // Against the memory a knock counts in many pairs, so each of these counts little.
    turned = std::max(against_memory_.exceededBy(distance(now, sums_), kMemory),
                      against_last_.exceededBy(distance(now, last_), kUsualMemory));
    last_ = now;
  }
  const Sums past{kMemory * sums_.information, kMemory * sums_.gradient, kMemory * sums_.square,
                  kMemory * sums_.weight};
  sums_ = sumUp(features, past);
  return turned;
}

double RightCameraRotation::UsualChange::exceededBy(double change, double memory_of_large) {
  const double usual = std::max(kUsualOfRigs, std::sqrt(square)), limit = kUnusual * usual;
  // A knock is one large change. What changes in many pairs is the rig's way: each counts up to the limit.
  const double counted = std::min(change, limit);
  const double memory = change > limit ? memory_of_large : kUsualMemory;
  square += (1.0 - memory) * (counted * counted - square);
  return change / usual;
}

double RightCameraRotation::distance(const Sums& now, const Sums& before) {
  if (now.weight <= 0.0 || before.weight <= 0.0) return 0.0;
  const Eigen::Vector3d change = now.rotation() - before.rotation();
  return std::sqrt(change.dot(now.information * change) / now.weight);
}

Eigen::Vector3d RightCameraRotation::Sums::rotation() const {
  return (information + kPrior * Eigen::Matrix3d::Identity()).inverse() * gradient;
}

Eigen::Vector3d RightCameraRotation::rotation() const {
  if (sums_.weight <= 0.0) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return sums_.rotation();
}

Eigen::Vector3d RightCameraRotation::sigma() const {
  if (sums_.weight <= 0.0) return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Matrix3d covariance = (sums_.information + kPrior * Eigen::Matrix3d::Identity()).inverse();
  return (kCorrelatedSightings * sums_.square / sums_.weight * covariance.diagonal()).cwiseSqrt();
}

}  // namespace sdvo
