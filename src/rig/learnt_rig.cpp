#include "learnt_rig.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Covariance of a measured rotation, with errors of rectification.
Eigen::Matrix3d withRectification(const RightRotation& measured) {
  constexpr double kUsual = 0.2;  // px (rms): healthy rigs (KITTI, EuRoC) have half a pixel at most
  return measured.covariance + kUsual * kUsual * measured.by_pixel;
}

/// Log-likelihood ratio that the rotation, for which features are compensated, moved the rows, against a fault of the
/// disparities alone. `remaining`: rotation by rows after the compensation.
double logRatioOfRows(const std::optional<RightRotation>& remaining, const Eigen::Vector3d& rotation) {
  if (!remaining) return 0.0;
  const Eigen::Matrix3d information = withRectification(*remaining).inverse();
  const Eigen::Vector3d before = remaining->value + rotation;
  return 0.5 * (before.dot(information * before) - remaining->value.dot(information * remaining->value));
}

/// log(1 + exp(x)), for any x.
double logOnePlus(double x) {
  return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x)));
}

}  // namespace

std::string RotationHypothesis::words() const {
  const Eigen::Vector3d mrad = 1e3 * value;
  return text(2, "the right camera seems to have turned by ", value.norm() * 180.0 / CV_PI, " degrees (") +
         text(1, mrad.x(), " ", mrad.y(), " ", mrad.z(), " mrad about x, y, z): calibrate again");
}

LearntRig::LearntRig(const CalibrationOptions& options, const NoiseOptions& assumed)
    : calibration(options), noise(assumed), assumed_(assumed), delay_sigma_(options.right_delay_sigma) {}

/// Weighs a rotation against errors of rectification and the noise of this rig's rotations.
RotationHypothesis LearntRig::rotationHypothesis(const StereoFeatures& features, const MotionHypothesis& found,
                                                 const Eigen::Vector3d& compensated, const Eigen::Matrix3d& turns,
                                                 double dt) const {
  constexpr double kKnock = 0.0175;  // rad (chosen): prior of a knock, a degree
  RotationHypothesis hypothesis;
  if (features.count() < kFewestMeasured) return hypothesis;
  std::optional<RightRotation> by_disparities;
  // A minority's motion may be a mover's. With a compensated rotation, more matches and the rows have to confirm it.
  if (found.isOfMajority() || (found.motion.success && !compensated.isZero())) {
    NoiseOptions scaled = assumed_;
    scaled.corner *= noise.scale();
    by_disparities = rotationByDisparities(features.camera, scaled, found.correspondences, found.motion.inliers,
                                           found.motion.T_current_reference);
  }
  const std::optional<RightRotation> by_rows = row_pattern.change(features);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  for (const auto& by : {by_rows, by_disparities}) {
    if (!by) continue;
    const Eigen::Matrix3d known = withRectification(*by).inverse();
    information += known, weighted += known * by->value;
  }
  if (!(information.determinant() > 0.0)) return hypothesis;
  const Eigen::Matrix3d covariance = information.inverse();
  // A right image that is late by d looks rotated by d / dt of the camera's rotation. The map's last pair may be late,
  // too.
  const double late = dt > 0.0 ? delay_sigma_ / dt : 0.0;
  hypothesis.value = compensated + covariance * weighted;
  hypothesis.covariance = covariance + late * late * turns + rotation_noise_;
  const auto log_factor = [&](const Eigen::Matrix3d& prior) {
    return logBayesFactor<3>(hypothesis.value, hypothesis.covariance.inverse(), prior);
  };
  const double knock = kUnsuspected + log_factor(kKnock * kKnock * Eigen::Matrix3d::Identity());
  const double other_moment = log_prior_of_other_moment_ + log_factor(turns);
  // The odds of each cause are against the other one and no change.
  hypothesis.log_odds = knock - logOnePlus(other_moment);
  if (!compensated.isZero()) hypothesis.log_odds = std::min(hypothesis.log_odds, logRatioOfRows(by_rows, compensated));
  hypothesis.log_odds_of_other_moment = other_moment - logOnePlus(knock);
  return hypothesis;
}

std::vector<RowMotion> LearntRig::rowMotions(const StereoFeatures& features, const MotionHypothesis& found,
                                             double dt) const {
  const StereoCamera& camera = features.camera;
  const double delay = features.right_delay + calibration.delay();
  // Mean rows of other pairs' right images contain the delay itself: subtracting them would hide it.
  const bool has_pattern = !row_pattern.isOfOtherPairs(dt);
  std::vector<RowMotion> rows;
  rows.reserve(found.motion.inliers.size());
  for (const int i : found.motion.inliers) {
    const auto [reference, current, distance] = found.matches[i];
    const Eigen::Vector3d now = found.motion.T_current_reference * found.view->points.positions[reference];
    const double velocity = (camera.project(now).y() - found.view->pixels[reference].y) / dt;
    const double dv = has_pattern ? row_pattern.change(features, current) : features.dv[current];
    rows.push_back({velocity, dv - delay * velocity,
                    RowDelay::partOf(features.u[current], features.v[current], camera.width, camera.height)});
  }
  return rows;
}

RigEstimate::Matrix LearntRig::rotate(const RotationHypothesis& new_rotation, const StereoCamera& camera) {
  const Eigen::Vector3d now = rotation + new_rotation.value, back = now - rotation_before_;
  const Eigen::Matrix3d covariance = rotation_covariance + new_rotation.covariance;
  rotated_last_ = !(back.dot((covariance + covariance_before_).inverse() * back) < noiseGate(3));
  if (rotated_last_) {
    rotation_before_ = std::exchange(rotation, now);
    covariance_before_ = std::exchange(rotation_covariance, covariance);
    return calibration.widen(camera, new_rotation.covariance);
  }
  // The rig is again as before the last rotation: an error of images, no knock. Its whole square is this rig's noise at
  // once, so that the next such error is not believed.
  std::swap(rotation, rotation_before_), std::swap(rotation_covariance, covariance_before_);
  rotation_noise_ += new_rotation.value * new_rotation.value.transpose();
  return RigEstimate::Matrix::Zero();
}

void LearntRig::learn(const StereoFeatures& features, const MeasuredPair* measured, const MotionHypothesis& found,
                      const RotationHypothesis& new_rotation, bool is_confirmed) {
  if (!(new_rotation.log_odds > 0.0) && std::exchange(rotated_last_, false)) {
    // With the rotation of the pair before, many matches agree on no motion: it was an error of images.
    if (!measured && found.agreement.matches >= kFewestMeasured) {
      const Eigen::Vector3d back = rotation - rotation_before_;
      rotation_noise_ += back * back.transpose();
      rotation = rotation_before_, rotation_covariance = covariance_before_;
    }
  }
  log_prior_of_other_moment_ = features.report.refused ? kUnsuspected : log_prior_of_other_moment_ - std::log(2.0);
  if (is_confirmed) {
    rotation_noise_ += (1.0 - kUsualMemory) * (new_rotation.value * new_rotation.value.transpose() - rotation_noise_);
    row_pattern.learn(features, measured ? measured->rows : std::vector<RowMotion>());
    noise.learn(found.motion.rms);
    if (found.lasting_square) noise.learnShared(*found.lasting_square);
  }
  if (measured)
    right_delay.learn(measured->features, measured->dt, measured->velocity(), calibration.delay(), is_confirmed);
  else
    right_delay.interrupt();
  if (measured && is_confirmed)
    readout.add(measured->features, found, measured->since_reference);
  else
    readout.interrupt();
  if (const auto delay = right_delay.estimate())
    calibration.updateByRows(RigEstimate::kDelay, delay->value, delay->sigma);
  if (const auto by_rows = row_pattern.rotation())
    calibration.updateByRows(RigEstimate::kRoll, by_rows->value.z(), std::sqrt(withRectification(*by_rows)(2, 2)));
}

}  // namespace sdvo
