#include "stereo_descriptor_vo/odometry/pose_covariance.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace sdvo {
namespace {

/// What a discontinuity of unknown size adds: metres and a good part of a right angle.
Matrix6d discontinuity() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(100.0), Eigen::Vector3d::Constant(0.25);
  return variance.asDiagonal();
}

/// The nearest positive semi-definite matrix to a symmetric one.
Matrix6d positivePart(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() * solver.eigenvectors().transpose();
}

/// The covariance of a pose T as that of T * M: T exp(xi) M = T M exp(Ad(M^-1) xi).
Matrix6d carriedBy(const Eigen::Isometry3d& motion, const Matrix6d& covariance) {
  const Matrix6d ad = adjoint(motion.inverse());
  const Matrix6d carried = ad * covariance * ad.transpose();
  return 0.5 * (carried + carried.transpose());
}

/// A covariance, its translation and its rotation each scaled up to the trace that they had before.
Matrix6d noLessThan(const Matrix6d& before, Matrix6d covariance) {
  for (const int first : {0, 3}) {
    const double had = before.block<3, 3>(first, first).trace(), has = covariance.block<3, 3>(first, first).trace();
    if (!(has < had)) continue;
    if (!(has > 0.0)) return before;
    const double factor = std::sqrt(had / has);
    covariance.middleRows<3>(first) *= factor;
    covariance.middleCols<3>(first) *= factor;
  }
  return covariance;
}

}  // namespace

bool widen(Matrix6d& covariance, const Vector6d& deviation) {
  constexpr double kExpected = 3.0, kByChance = 12.6;  // chi-square of six: half its mean, for a deviation is a part of
                                                       // the whole error only, and 95 %
  const double square = deviation.dot(covariance.ldlt().solve(deviation));
  if (square > kExpected) covariance += deviation * deviation.transpose();
  return square > kByChance;
}

void PoseCovariance::cover(const Vector6d& correction) {
  const Matrix6d before = value_;
  widen(value_, correction);
  keyframe_ += value_ - before;  // the next poses are measured from the same key frame
}

void PoseCovariance::restart(const Matrix6d& travelled) {
  value_ += discontinuity() + travelled;
  since_keyframe_.setZero();
  last_window_.reset();
  markKeyframe();
}

void PoseCovariance::markKeyframe() {
  if (last_window_) value_ += (kAlike - 1.0) * last_window_->since_keyframe;
  keyframe_ = value_;
  last_is_keyframe_ = true;
}

void PoseCovariance::carry(const Eigen::Isometry3d& T_previous_current) {
  value_ = carriedBy(T_previous_current, value_);
  keyframe_ = carriedBy(T_previous_current, keyframe_);
}

void PoseCovariance::advance(const Eigen::Isometry3d& T_previous_current, const Matrix6d& covariance) {
  carry(T_previous_current);
  value_ += covariance;
  since_keyframe_ =
      covariance + (last_is_keyframe_ ? Matrix6d(Matrix6d::Zero()) : carriedBy(T_previous_current, since_keyframe_));
  last_is_keyframe_ = false;
  last_window_.reset();
}

Matrix6d PoseCovariance::advance(const Eigen::Isometry3d& T_previous_current, const WindowCovariances& window) {
  const Matrix6d motion = carriedBy(T_previous_current, outdated(window)) + window.since_keyframe;
  carry(T_previous_current);
  const Matrix6d measured = keyframe_ + window.since_keyframe;
  value_ = noLessThan(value_, measured);
  since_keyframe_ = window.since_keyframe;
  last_is_keyframe_ = false;
  last_window_ = window;
  return motion;
}

void PoseCovariance::doubt(const Matrix6d& covariance) {
  value_ += covariance;
  since_keyframe_ += covariance;
  last_window_.reset();
}

/// What the last pose lacked when it was reported, seen from the key frame that the new pair is measured from.
Matrix6d PoseCovariance::outdated(const WindowCovariances& window) const {
  if (!last_is_keyframe_ || !last_window_) return since_keyframe_;
  if (window.first_id < last_window_->first_id)
    return since_keyframe_;  // an older frame was recalled: nothing in common
  // It is that key frame itself: this window knows it better than its own did.
  const Matrix6d& then =
      window.first_id == last_window_->first_id ? last_window_->since_first : last_window_->since_second;
  return positivePart(then - window.keyframe_since_first);
}

}  // namespace sdvo
