#include "pose_covariance.hpp"

#include <Eigen/LU>
#include <cmath>

#include "../motion/noise.hpp"
#include "motion_hypotheses.hpp"

namespace sdvo {
namespace {

/// The covariance of a pose T as that of T * M: T exp(xi) M = T M exp(Ad(M^-1) xi).
Matrix6d carriedBy(const Eigen::Isometry3d& motion, const Matrix6d& covariance) {
  const Matrix6d moved = carried(motion.inverse(), covariance);
  return 0.5 * (moved + moved.transpose());
}

/// The covariance with translation and rotation scaled up to their traces before, if these were larger.
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

/// A covariance that is no less than either in any direction.
Matrix6d covering(const Matrix6d& a, const Matrix6d& b) {
  return b + positivePart(a - b);
}

}  // namespace

Matrix6d missingCovariance(const Matrix6d& covariance, const Vector6d& deviation) {
  constexpr double kExpected = 3.0;  // half the mean of chi-square of six: a deviation is a part of the error
  if (!(mahalanobisSquare(deviation, covariance) > kExpected)) return Matrix6d::Zero();
  return deviation * deviation.transpose() + kTolerableRatio * kTolerableRatio * momentOf(deviation);
}

Matrix6d PoseCovariance::momentOf(const Exposure& exposure, const RigEstimate& known) {
  const RigEstimate::MotionJacobian derivative = exposure.leftCols<RigEstimate::kParameters>();
  const Vector6d deviation = derivative * known.mean + exposure.rightCols<1>();
  return derivative * known.covariance * derivative.transpose() + deviation * deviation.transpose();
}

Matrix6d PoseCovariance::updateExposure(const RigEstimate::MotionJacobian& since_keyframe, const RigEstimate& known,
                                        const RigEstimate::Vector& compensated) {
  const Exposure before = exposure_;
  exposure_ = keyframe_exposure_;
  exposure_.leftCols<RigEstimate::kParameters>() += since_keyframe;
  exposure_.rightCols<1>() -= since_keyframe * compensated;
  return momentOf(exposure_ - before, known);
}

void PoseCovariance::walkRig(const RigEstimate& known, const RigEstimate::Matrix& step) {
  if (step.isZero()) return;  // what is certain of the rig has no inverse then
  expressByNewRig(known, known.covariance * (known.covariance + step).inverse());
}

/// The old rig is known.mean + kept * (new rig - known.mean), and a remainder that is independent of the new one.
void PoseCovariance::expressByNewRig(const RigEstimate& known, const RigEstimate::Matrix& kept) {
  const RigEstimate::Matrix gone = RigEstimate::Matrix::Identity() - kept;
  const auto express = [&](Exposure& exposure, Matrix6d& covariance) {
    const RigEstimate::MotionJacobian derivative = exposure.leftCols<RigEstimate::kParameters>();
    const Matrix6d remainder = derivative * gone * known.covariance * derivative.transpose();
    covariance += 0.5 * (remainder + remainder.transpose());
    exposure.rightCols<1>() += derivative * gone * known.mean;
    exposure.leftCols<RigEstimate::kParameters>() = derivative * kept;
  };
  express(exposure_, measured_);
  express(keyframe_exposure_, keyframe_);
}

void PoseCovariance::coverCorrection(const Vector6d& correction) {
  inflate(missingCovariance(value(), correction));  // the next poses are measured from the same key frame
}

void PoseCovariance::beginMap() {
  measured_ += pose_doubt_;
  pose_doubt_.setZero();
  motion_doubt_.setZero();
  markKeyframe();
}

void PoseCovariance::markKeyframe() {
  keyframe_ = measured_;
  keyframe_exposure_ = exposure_;
  since_keyframe_.reset();
}

void PoseCovariance::carry(const Eigen::Isometry3d& T_previous_current) {
  for (Matrix6d* covariance : {&measured_, &keyframe_, &pose_doubt_, &motion_doubt_})
    *covariance = carriedBy(T_previous_current, *covariance);
  if (since_keyframe_) since_keyframe_ = carriedBy(T_previous_current, *since_keyframe_);
  for (Exposure* exposure : {&exposure_, &keyframe_exposure_})
    *exposure = adjoint(T_previous_current.inverse()) * *exposure;
}

void PoseCovariance::predict(const Eigen::Isometry3d& T_previous_current, const Matrix6d& covariance) {
  carry(T_previous_current);
  addDoubt(covariance, covariance);
}

Matrix6d PoseCovariance::update(const Eigen::Isometry3d& T_previous_current, const Matrix6d& since_keyframe,
                                const Matrix6d& growth) {
  const Matrix6d before = measured_;
  carry(T_previous_current);
  const Matrix6d motion =
      motion_doubt_ + (since_keyframe_ ? covering(*since_keyframe_, since_keyframe) : since_keyframe);
  since_keyframe_ = since_keyframe;
  measured_ = noLessThan(before, keyframe_ + growth);
  pose_doubt_.setZero();
  motion_doubt_.setZero();
  return motion;
}

void PoseCovariance::addDoubt(const Matrix6d& motion, const Matrix6d& pose) {
  pose_doubt_ += pose;
  motion_doubt_ += motion;
}

}  // namespace sdvo
