#include "calibration_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "../motion/noise.hpp"

namespace sdvo {
namespace {

using Matrix = RigEstimate::Matrix;
using Vector = RigEstimate::Vector;

constexpr int kRememberedCommons = 200;  // windows (chosen): memory of updateCommon()
// px/sqrt(s) (chosen): offset and bend change by 0.5 px in 100 s, by warmth or by knocks too small for a detection.
constexpr double kDisparityWalk = 0.05;
constexpr double kRollWalk = 5e-5;   // rad/sqrt(s) (chosen): kDisparityWalk at f = 1000 px
constexpr double kDelayWalk = 1e-4;  // s/sqrt(s) (chosen): 1 ms in 100 s, as of clocks whose rates differ by 1e-5

Vector priorOf(const CalibrationOptions& options) {
  return {options.prior_offset, options.prior_bend, 0.0, options.right_delay};
}

/// Diagonal of (offset, bend, roll, delay): variances or standard deviations.
Matrix diagonal(double disparity, double roll, double delay) {
  return Vector(disparity, disparity, roll, delay).asDiagonal();
}

}  // namespace

CalibrationFilter::CalibrationFilter(const CalibrationOptions& options) : options_(checked(options)) {
  compensated_ = priorOf(options_);
  calibration_.value = compensated_.head<RigCalibration::kParameters>();
}

CalibrationBelief CalibrationFilter::prior(const RigEstimate::CalibrationByRig& calibration_by_rig) const {
  constexpr double kExact = 0.01;  // px: 0.1 % of the depth at 10 px of disparity; less is ill-conditioned
  CalibrationBelief belief;
  RigCalibration::Matrix covariance = kExact * kExact * RigCalibration::Matrix::Identity();
  belief.mean = priorOf(options_).head<RigCalibration::kParameters>();
  if (options_.enabled) {
    const RigEstimate known = estimate();
    belief.mean = calibration_by_rig.leftCols<RigEstimate::kDelay>() * known.mean.head<RigEstimate::kDelay>();
    covariance += calibration_by_rig * known.covariance * calibration_by_rig.transpose();
  }
  // In the units of the adjustment, whose own information is too large by 1 / kRealInformation.
  belief.information = covariance.inverse() / kRealInformation;
  if (commons_ >= kFewestMeasured) belief.common_sigma = std::sqrt(std::max(common_square_, 0.0));
  return belief;
}

RigEstimate CalibrationFilter::posterior(const Likelihood& windows) const {
  const Vector prior = priorOf(options_);
  Matrix information = windows.information;
  Vector weighted = windows.information_mean - information * prior;
  information.diagonal() += rows_information_;
  weighted += rows_information_.cwiseProduct(rows_ - prior);
  struct Component {
    double log_weight;
    Vector mean;
    Matrix covariance;
  };
  std::vector<Component> components;
  double largest = 0.0;
  const double is_estimated = options_.enabled ? 1.0 : 0.0;
  for (const double disparity_sigma : {0.0, is_estimated * options_.prior_sigma})
    for (const double roll_sigma : {0.0, is_estimated * options_.right_roll_sigma})
      for (const double delay_sigma : {0.0, options_.right_delay_sigma}) {
        const Matrix sigma = diagonal(disparity_sigma, roll_sigma, delay_sigma);
        const Matrix whitened = Matrix::Identity() + sigma * information * sigma;
        const Matrix covariance = sigma * whitened.inverse() * sigma;
        const Vector mean = covariance * weighted;
        components.push_back({0.5 * (weighted.dot(mean) - std::log(whitened.determinant())), mean, covariance});
        largest = std::max(largest, components.back().log_weight);
      }
  RigEstimate estimate;
  double sum = 0.0;
  for (const auto& [log_weight, mean, covariance] : components) {
    const double weight = std::exp(log_weight - largest);
    sum += weight;
    estimate.mean += weight * mean;
    estimate.covariance += weight * (covariance + mean * mean.transpose());
  }
  estimate.mean /= sum;
  estimate.covariance = (estimate.covariance / sum - estimate.mean * estimate.mean.transpose()).eval();
  estimate.mean += prior;
  return estimate;
}

RigEstimate CalibrationFilter::compensated() const {
  const RigEstimate known = estimate();
  const Vector apart = known.mean - compensated_;
  return {compensated_, known.covariance + apart * apart.transpose()};
}

void CalibrationFilter::updateCommon(double square) {
  commons_ = std::min(commons_ + 1, kRememberedCommons);
  common_square_ += (square - common_square_) / commons_;
}

void CalibrationFilter::update(int oldest_id, int newest_id, const RigEstimate::CalibrationByRig& calibration_by_rig,
                               const RigCalibration& calibration, const RigCalibration::Matrix& information) {
  const CalibrationBelief prior = this->prior(calibration_by_rig);
  compensated_ << calibration.value.head<2>(), calibration.value[2] / calibration_by_rig(2, RigEstimate::kRoll),
      delay();
  calibration_ = calibration;
  // 1. The window's own information, without its prior: own * own_mean = (own + prior) * value - prior * prior_mean.
  // The value lacks the effect of the delay, for which disparities are compensated: by_delay adds it again.
  // Rounding makes `information` asymmetric, which would grow from window to window.
  const RigCalibration::Vector by_delay =
      calibration_by_rig.col(RigEstimate::kDelay) * compensated_[RigEstimate::kDelay];
  const RigCalibration::Matrix own = 0.5 * kRealInformation * (information + information.transpose());
  const RigCalibration::Vector own_mean =
      own * (calibration.value + by_delay) + kRealInformation * prior.information * (calibration.value - prior.mean);
  // 2. Add it to the windows before that share no pair with it.
  if (next_past_id_ >= 0 && next_past_id_ < oldest_id) past_ = next_past_;
  present_ = Likelihood{past_.information + calibration_by_rig.transpose() * own * calibration_by_rig,
                        past_.information_mean + calibration_by_rig.transpose() * own_mean};
  // 3. It is the past of windows that begin after its last pair.
  if (next_past_id_ >= oldest_id) return;
  next_past_id_ = newest_id;
  next_past_ = *present_;
}

void CalibrationFilter::updateByRows(int parameter, double value, double sigma) {
  constexpr double kExact = 1e-6;  // rad or s, the options' least sigma: rows of a simulator have no noise
  rows_information_[parameter] = 1.0 / (sigma * sigma + kExact * kExact);
  rows_[parameter] = value;
}

Matrix CalibrationFilter::predict(double dt) {
  return widen(
      diagonal(kDisparityWalk * kDisparityWalk * dt, kRollWalk * kRollWalk * dt, kDelayWalk * kDelayWalk * dt));
}

Matrix CalibrationFilter::widen(const StereoCamera& camera, const Eigen::Matrix3d& rotation) {
  const auto by_rotation = RigEstimate::byRotation(camera);
  return widen(by_rotation * rotation * by_rotation.transpose());
}

Matrix CalibrationFilter::widen(const Matrix& covariance) {
  const auto widened = [&](Likelihood& known) {
    const Matrix less = (Matrix::Identity() + known.information * covariance).inverse();
    known = {less * known.information, less * known.information_mean};
  };
  widened(past_), widened(next_past_);
  if (present_) widened(*present_);
  return covariance;
}

}  // namespace sdvo
