#include "stereo_descriptor_vo/odometry/calibration_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace sdvo {
namespace {

constexpr int kFewestCommons = 20;       // windows that must tell of what is left at a point
constexpr int kRememberedCommons = 200;  // of which the mean is taken
constexpr double kAlike = 1.4;           // on the variance: neighbouring points err alike, so many tell less

}  // namespace

CalibrationFilter::CalibrationFilter(const CalibrationOptions& options) : options_(checked(options)) {
  // The windows keep their nominal precision; weighing the prior up by 1/trust^2 says the same.
  const double sigma = options_.enabled ? options_.trust * options_.prior_sigma : 1e-6;
  option_information_ = RigCalibration::Matrix::Identity() / (sigma * sigma);
  calibration_.value << options_.prior_offset, options_.prior_bend;
  option_information_mean_ = option_information_ * calibration_.value;
}

CalibrationBelief CalibrationFilter::prior(int oldest_id) {
  if (pending_ && pending_->newest_id < oldest_id) {
    information_ = options_.memory * information_ + pending_->information;
    information_mean_ = options_.memory * information_mean_ + pending_->information_mean;
    pending_.reset();
  }
  const RigCalibration::Matrix information = option_information_ + information_;
  CalibrationBelief belief{information.inverse() * (option_information_mean_ + information_mean_), information};
  if (commons_ >= kFewestCommons) belief.common_sigma = std::sqrt(kAlike * common_square_);
  return belief;
}

void CalibrationFilter::noteCommon(double square) {
  commons_ = std::min(commons_ + 1, kRememberedCommons);
  common_square_ += (square - common_square_) / commons_;
}

void CalibrationFilter::note(int newest_id, const RigCalibration& calibration,
                             const RigCalibration::Matrix& information) {
  calibration_ = calibration;
  total_information_ = option_information_ + information_ + information;
  if (!pending_)
    pending_ = {newest_id, information,
                *total_information_ * calibration.value - option_information_mean_ - information_mean_};
}

RigCalibration::Vector CalibrationFilter::sigma() const {
  if (!total_information_ || !options_.enabled)
    return RigCalibration::Vector::Constant(std::numeric_limits<double>::quiet_NaN());
  return total_information_->inverse().diagonal().cwiseSqrt() / options_.trust;
}

}  // namespace sdvo
