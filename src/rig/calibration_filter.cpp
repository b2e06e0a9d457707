#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "../belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
namespace {

using Matrix = RigCalibration::Matrix;
using Vector = RigCalibration::Vector;

constexpr int kRememberedCommons = 200;  // windows (chosen) over which the mean of what is left at a point is taken
// px/sqrt(s) (chosen): half a pixel in 100 s, by warmth or by small knocks that no detector finds.
constexpr double kWarming = 0.05;

Vector priorOf(const CalibrationOptions& options) {
  return {options.prior_offset, options.prior_bend};
}

}  // namespace

CalibrationFilter::CalibrationFilter(const CalibrationOptions& options) : options_(checked(options)) {
  calibration_.value = priorOf(options_);
}

const CalibrationFilter::Evidence& CalibrationFilter::pastBefore(int oldest_id) const {
  return pending_id_ >= 0 && pending_id_ < oldest_id ? pending_ : past_;
}

CalibrationBelief CalibrationFilter::prior(int oldest_id) const {
  constexpr double kExact = 0.01;  // px: 0.1 % of the depth at 10 px of disparity; less makes the equations stiff
  const CalibrationEstimate known = weigh(pastBefore(oldest_id));
  const Matrix covariance = known.covariance + kExact * kExact * Matrix::Identity();
  CalibrationBelief belief{known.mean, covariance.inverse() / kHonest};
  if (commons_ >= kFewestMeasured) belief.common_sigma = std::sqrt(std::max(common_square_, 0.0));
  return belief;
}

/// Mean and covariance of the mixture, given the windows' evidence.
CalibrationEstimate CalibrationFilter::weigh(const Evidence& evidence) const {
  const Vector prior = priorOf(options_);
  if (!options_.enabled) return {prior, Matrix::Zero()};
  const double variance = options_.prior_sigma * options_.prior_sigma;
  const Matrix covariance = (evidence.information + Matrix::Identity() / variance).inverse();
  const Vector shown = evidence.information_mean - evidence.information * prior, distance = covariance * shown;
  const double log_factor = 0.5 * (shown.dot(distance) + std::log(covariance.determinant() / (variance * variance)));
  const double other = probabilityOf(log_factor);
  return {prior + other * distance, other * covariance + other * (1.0 - other) * distance * distance.transpose()};
}

void CalibrationFilter::noteCommon(double square) {
  commons_ = std::min(commons_ + 1, kRememberedCommons);
  common_square_ += (square - common_square_) / commons_;
}

void CalibrationFilter::note(int oldest_id, int newest_id, const RigCalibration& calibration,
                             const Matrix& information) {
  const CalibrationBelief prior = this->prior(oldest_id);
  past_ = pastBefore(oldest_id);
  calibration_ = calibration;
  // The window's result combines its own evidence with the prior, so its own is the result's less the prior's. Only one
  // triangle of `information` is accurate; a difference between both would grow from window to window.
  const Matrix own = 0.5 * kHonest * (information + information.transpose());
  const Vector own_mean = own * calibration.value + kHonest * prior.information * (calibration.value - prior.mean);
  present_ = Evidence{past_.information + own, past_.information_mean + own_mean};
  if (pending_id_ >= oldest_id) return;
  pending_id_ = newest_id;
  pending_ = *present_;
}

void CalibrationFilter::predict(double dt) {
  widen(kWarming * kWarming * dt * Matrix::Identity());
}

void CalibrationFilter::widen(double variance) {
  widen(variance * Matrix::Ones());
}

void CalibrationFilter::widen(const Matrix& covariance) {
  const auto widened = [&](Evidence& known) {
    const Matrix less = (Matrix::Identity() + known.information * covariance).inverse();
    known = {less * known.information, less * known.information_mean};
  };
  widened(past_), widened(pending_);
  if (present_) widened(*present_);
}

CalibrationEstimate CalibrationFilter::estimate() const {
  return weigh(present_.value_or(Evidence()));
}

RigCalibration::Vector CalibrationFilter::sigma() const {
  if (!present_ || !options_.enabled) return Vector::Constant(std::numeric_limits<double>::quiet_NaN());
  return estimate().covariance.diagonal().cwiseSqrt();
}

}  // namespace sdvo
