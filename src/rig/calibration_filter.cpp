#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
namespace {

constexpr int kRememberedCommons = 200;  // windows (chosen) over which the mean of what is left at a point is taken

}  // namespace

CalibrationFilter::CalibrationFilter(const CalibrationOptions& options) : options_(checked(options)) {
  calibration_.value << options_.prior_offset, options_.prior_bend;
}

CalibrationFilter::Information CalibrationFilter::pastBefore(int oldest_id) const {
  if (!pending_ || pending_->newest_id >= oldest_id) return past_;
  return pending_->evidence;
}

/// What the options say beforehand, as far as the evidence leaves it its weight.
CalibrationFilter::Information CalibrationFilter::beforehand() const {
  const RigCalibration::Matrix information = informationOf(significantSpread());
  return {information, information * RigCalibration::Vector(options_.prior_offset, options_.prior_bend)};
}

CalibrationBelief CalibrationFilter::prior(int oldest_id) const {
  const Information past = pastBefore(oldest_id), held = beforehand();
  const RigCalibration::Matrix information = held.information + past.information;
  CalibrationBelief belief{information.inverse() * (held.information_mean + past.information_mean), information};
  if (options_.enabled)
    belief.certain_information =
        informationOf(RigCalibration::Vector::Constant(options_.prior_sigma)) + past.information;
  if (commons_ >= kFewestMeasured) belief.common_sigma = std::sqrt(std::max(common_square_, 0.0));
  return belief;
}

/// The windows keep the precision that they state; a prior weighed up by 1 / kTrust^2 is the same.
RigCalibration::Matrix CalibrationFilter::informationOf(const RigCalibration::Vector& spread) const {
  return (kTrust * spread).cwiseAbs2().cwiseInverse().asDiagonal();
}

/// Standard deviation, px, of the rig around the options' prior: as much of the evidence's distance from it as chance
/// does not explain.
RigCalibration::Vector CalibrationFilter::significantSpread() const {
  constexpr double kHeld = 1e-4;  // px: holds the calibration where the options put it
  RigCalibration::Vector spread = RigCalibration::Vector::Constant(kHeld);
  if (!options_.enabled || !present_) return spread;
  const RigCalibration::Matrix covariance = present_->information.inverse();
  const RigCalibration::Vector estimate = covariance * present_->information_mean;
  const RigCalibration::Vector prior(options_.prior_offset, options_.prior_bend);
  const RigCalibration::Vector chance = noiseGate(1) * covariance.diagonal();
  for (int i = 0; i < RigCalibration::kParameters; ++i) {
    const double distance = estimate[i] - prior[i];
    const double significant = std::sqrt(std::max(distance * distance - chance[i], 0.0));
    spread[i] = std::clamp(significant, spread[i], options_.prior_sigma);
  }
  return spread;
}

void CalibrationFilter::noteCommon(double square) {
  commons_ = std::min(commons_ + 1, kRememberedCommons);
  common_square_ += (square - common_square_) / commons_;
}

void CalibrationFilter::note(int oldest_id, int newest_id, const RigCalibration& calibration,
                             const RigCalibration::Matrix& information) {
  const Information held = beforehand();
  past_ = pastBefore(oldest_id);
  if (pending_ && pending_->newest_id < oldest_id) pending_.reset();
  calibration_ = calibration;
  const RigCalibration::Matrix known = past_.information + information;
  present_ = Information{known, (held.information + known) * calibration.value - held.information_mean};
  if (!pending_) pending_ = {newest_id, {information, present_->information_mean - past_.information_mean}};
}

void CalibrationFilter::widen(double variance) {
  const auto widened = [&](Information& known) {
    const RigCalibration::Vector mean = known.information.ldlt().solve(known.information_mean);
    const RigCalibration::Matrix added = variance / (kTrust * kTrust) * RigCalibration::Matrix::Ones();
    known.information = (RigCalibration::Matrix::Identity() + known.information * added).inverse() * known.information;
    known.information_mean = known.information * mean;
  };
  widened(past_);
  if (pending_) widened(pending_->evidence);
  if (present_) widened(*present_);
}

CalibrationEstimate CalibrationFilter::estimate() const {
  const RigCalibration::Vector prior(options_.prior_offset, options_.prior_bend);
  if (!options_.enabled) return {prior, RigCalibration::Matrix::Zero()};
  const RigCalibration::Matrix of_prior = informationOf(RigCalibration::Vector::Constant(options_.prior_sigma));
  const Information known = present_.value_or(Information());
  const RigCalibration::Matrix covariance = (of_prior + known.information).inverse();
  return {covariance * (of_prior * prior + known.information_mean), covariance / (kTrust * kTrust)};
}

RigCalibration::Vector CalibrationFilter::sigma() const {
  if (!present_ || !options_.enabled) return RigCalibration::Vector::Constant(std::numeric_limits<double>::quiet_NaN());
  return estimate().covariance.diagonal().cwiseSqrt();
}

}  // namespace sdvo
