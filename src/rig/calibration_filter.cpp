#include "stereo_descriptor_vo/rig/calibration_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {
namespace {

using Matrix = RigEstimate::Matrix;
using Vector = RigEstimate::Vector;

constexpr int kRememberedCommons = 200;  // windows (chosen) over which the mean of what is left at a point is taken
// px/sqrt(s) (chosen): half a pixel in 100 s, by warmth or by small knocks that no detector finds.
constexpr double kWarming = 0.05;
constexpr double kClocks = 1e-4;  // s/sqrt(s) (chosen): a millisecond in 100 s, as of clocks whose rates differ by 1e-5

Vector priorOf(const CalibrationOptions& options) {
  return {options.prior_offset, options.prior_bend, options.right_delay};
}

}  // namespace

CalibrationFilter::CalibrationFilter(const CalibrationOptions& options) : options_(checked(options)) {
  calibration_.value = priorOf(options_).head<RigCalibration::kParameters>();
}

const CalibrationFilter::Evidence& CalibrationFilter::pastBefore(int oldest_id) const {
  return pending_id_ >= 0 && pending_id_ < oldest_id ? pending_ : past_;
}

CalibrationBelief CalibrationFilter::prior(int oldest_id, const RigEstimate::Shape& shape) const {
  constexpr double kExact = 0.01;  // px: 0.1 % of the depth at 10 px of disparity; less makes the equations stiff
  CalibrationBelief belief;
  RigCalibration::Matrix covariance = kExact * kExact * RigCalibration::Matrix::Identity();
  belief.mean = priorOf(options_).head<RigCalibration::kParameters>();
  if (options_.enabled) {
    const RigEstimate known = weigh(pastBefore(oldest_id));
    belief.mean = shape * known.mean - shape.col(RigEstimate::kDelay) * delay();
    covariance += shape * known.covariance * shape.transpose();
  }
  belief.information = covariance.inverse() / kHonest;
  if (commons_ >= kFewestMeasured) belief.common_sigma = std::sqrt(std::max(common_square_, 0.0));
  return belief;
}

/// Mean and covariance of the mixture: of rigs with and without an error of their disparities, and with and without one
/// of their delay.
RigEstimate CalibrationFilter::weigh(const Evidence& windows) const {
  const Vector prior = priorOf(options_);
  Matrix information = windows.information;
  Vector shown = windows.information_mean - information * prior;
  information(RigEstimate::kDelay, RigEstimate::kDelay) += rows_information_;
  shown[RigEstimate::kDelay] += rows_information_ * (rows_delay_ - prior[RigEstimate::kDelay]);
  struct Component {
    double log_weight;
    Vector mean;
    Matrix covariance;
  };
  std::vector<Component> components;
  double largest = 0.0;
  for (const double disparity_sigma : {0.0, options_.prior_sigma}) {
    if (disparity_sigma > 0.0 && !options_.enabled) continue;
    for (const double delay_sigma : {0.0, options_.right_delay_sigma}) {
      const Matrix sigma = Vector(disparity_sigma, disparity_sigma, delay_sigma).asDiagonal();
      const Matrix whitened = Matrix::Identity() + sigma * information * sigma;
      const Matrix covariance = sigma * whitened.inverse() * sigma;
      const Vector mean = covariance * shown;
      components.push_back({0.5 * (shown.dot(mean) - std::log(whitened.determinant())), mean, covariance});
      largest = std::max(largest, components.back().log_weight);
    }
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

void CalibrationFilter::noteCommon(double square) {
  commons_ = std::min(commons_ + 1, kRememberedCommons);
  common_square_ += (square - common_square_) / commons_;
}

void CalibrationFilter::note(int oldest_id, int newest_id, const RigEstimate::Shape& shape,
                             const RigCalibration& calibration, const RigCalibration::Matrix& information) {
  const CalibrationBelief prior = this->prior(oldest_id, shape);
  const RigCalibration::Vector compensated = shape.col(RigEstimate::kDelay) * delay();
  past_ = pastBefore(oldest_id);
  calibration_ = calibration;
  // The window's result combines its own evidence with the prior, so its own is the result's less the prior's. Only one
  // triangle of `information` is accurate; a difference between both would grow from window to window.
  const RigCalibration::Matrix own = 0.5 * kHonest * (information + information.transpose());
  const RigCalibration::Vector own_mean =
      own * (calibration.value + compensated) + kHonest * prior.information * (calibration.value - prior.mean);
  present_ = Evidence{past_.information + shape.transpose() * own * shape,
                      past_.information_mean + shape.transpose() * own_mean};
  if (pending_id_ >= oldest_id) return;
  pending_id_ = newest_id;
  pending_ = *present_;
}

void CalibrationFilter::noteRows(double delay, double sigma) {
  constexpr double kExact = 1e-6;  // s, as the least prior: rows without noise, as of a simulator
  rows_information_ = 1.0 / (sigma * sigma + kExact * kExact);
  rows_delay_ = delay;
}

void CalibrationFilter::predict(double dt) {
  widen(Matrix(Vector(kWarming * kWarming * dt, kWarming * kWarming * dt, kClocks * kClocks * dt).asDiagonal()));
}

void CalibrationFilter::widen(double variance) {
  Matrix covariance = Matrix::Zero();
  covariance.topLeftCorner<RigCalibration::kParameters, RigCalibration::kParameters>().setConstant(variance);
  widen(covariance);
}

void CalibrationFilter::widen(const Matrix& covariance) {
  const auto widened = [&](Evidence& known) {
    const Matrix less = (Matrix::Identity() + known.information * covariance).inverse();
    known = {less * known.information, less * known.information_mean};
  };
  widened(past_), widened(pending_);
  if (present_) widened(*present_);
}

}  // namespace sdvo
