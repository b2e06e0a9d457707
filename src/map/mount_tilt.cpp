#include "mount_tilt.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace sdvo {
namespace {

// Shorter ways and smaller turns of a pair are left out: ratio of the height's standard deviation, and rad (chosen).
constexpr double kLeast = 0.1, kLeastTurn = 1e-3;
// Least standard deviations of a way's height and of a turn, in the same units (chosen).
constexpr double kNoise = 0.01, kNoiseTurn = 1e-4;

}  // namespace

MountTilt::MountTilt(const PlanarOptions& options)
    : height_sigma_(options.planar_height_sigma), tilt_sigma_(options.planar_tilt_sigma * M_PI / 180.0) {}

void MountTilt::Sums::add(const Eigen::Vector2d& row, double value) {
  square += row * row.transpose();
  product += row * value;
  rest += value * value;
  ++count;
}

double MountTilt::Sums::variance(const Eigen::Vector2d& normal) const {
  const double residuals = rest - 2.0 * normal.dot(product) + normal.dot(square * normal);
  return std::max(residuals, 0.0) / std::max(count - 2, 1);
}

void MountTilt::add(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_previous_current) {
  if (!T_base_camera.isApprox(T_base_camera_, 1e-6)) {
    translations_ = rotations_ = {};
    distance_ = 0.0;
  }
  T_base_camera_ = T_base_camera;
  const Eigen::Isometry3d of_base = T_base_camera * T_previous_current * T_base_camera.inverse();
  const Eigen::Vector3d t = of_base.translation(), turn = logSO3(of_base.linear());
  if (t.norm() > kLeast * height_sigma_) translations_.add(t.head<2>(), -t.z());  // along the floor
  distance_ += t.norm();
  if (turn.norm() < kLeastTurn) return;
  for (const int axis : {0, 1}) rotations_.add(turn.z() * Eigen::Vector2d::Unit(axis), turn[axis]);  // about its normal
}

MountTilt::Estimate MountTilt::estimate(double sigma) const {
  return solve(Eigen::Matrix2d::Identity() / (sigma * sigma), Eigen::Vector2d::Zero());
}

MountTilt::Estimate MountTilt::solve(const Eigen::Matrix2d& information, const Eigen::Vector2d& product) const {
  const double least = kNoise * height_sigma_;
  Estimate found{Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()};
  constexpr int kPasses = 3;
  for (int pass = 1; pass <= kPasses; ++pass) {
    const double of_translations = std::max(translations_.variance(found.normal), least * least);
    const double of_rotations = std::max(rotations_.variance(found.normal), kNoiseTurn * kNoiseTurn);
    // The first passes measure the motions' noise around their own normal, with a prior of 1 rad. Around a tight prior
    // that they contradict, their noise would seem large and their weight would vanish.
    const bool is_last = pass == kPasses;
    found.covariance = (translations_.square / of_translations + rotations_.square / of_rotations +
                        (is_last ? information : Eigen::Matrix2d::Identity()))
                           .inverse();
    found.normal = found.covariance * (translations_.product / of_translations + rotations_.product / of_rotations);
    if (is_last) found.normal += found.covariance * product;
  }
  return found;
}

Matrix6d MountTilt::ofPose(const Eigen::Isometry3d& T_base_camera, const Eigen::Isometry3d& T_origin_camera,
                           bool is_on_floor) const {
  const Eigen::Isometry3d T_origin_base = T_base_camera * T_origin_camera * T_base_camera.inverse();
  Sums known;
  for (const int axis : {0, 1}) known.add(Eigen::Vector2d::Unit(axis) / tilt_sigma_, 0.0);
  const Eigen::Vector3d way = T_origin_base.translation();
  if (is_on_floor) known.add(way.head<2>() / height_sigma_, -way.z() / height_sigma_);
  const Estimate found = solve(known.square, known.product);
  // The turn E that makes (x, y, 1) upright is (y, -x, 0). It tilts the axes of origin and base alike:
  // E T_origin_base E^-1.
  Eigen::Matrix<double, 6, 2> by_normal = Eigen::Matrix<double, 6, 2>::Zero();
  by_normal(3, 1) = 1.0;
  by_normal(4, 0) = -1.0;
  by_normal = adjoint(T_base_camera.inverse()) * (adjoint(T_origin_base.inverse()) - Matrix6d::Identity()) * by_normal;
  return by_normal * (found.covariance + found.normal * found.normal.transpose()) * by_normal.transpose();
}

}  // namespace sdvo
