#pragma once

#include <optional>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

struct CalibrationOptions {
  bool enabled = true;
  double prior_offset = 0.0;
  double prior_bend = 0.0;
  double prior_sigma = 1.0;
  double right_roll_sigma = 0.001;  // chosen: 0.2 px at the upper edge of KITTI's images
  double right_delay = 0.0;
  double right_delay_sigma = 0.003;  // chosen: one trigger leaves 0.2 ms (twelve drives), none half a frame

  void describe(OptionList& list) {
    list.add("enabled", enabled, "estimate the rig's residual disparity error while driving and compensate it");
    list.add("prior_offset", prior_offset, {-20.0, 20.0}, "px",
             "that error in the image centre as far as it is known beforehand; held fixed when not enabled");
    list.add("prior_bend", prior_bend, {-20.0, 20.0}, "px", "the same for its change at 45 degrees from the centre");
    list.add("prior_sigma", prior_sigma, {1e-4, 10.0}, "px",
             "standard deviation of an error of both, in the centre and at 45 degrees from it, which is beforehand as "
             "likely as none");
    list.add("right_roll_sigma", right_roll_sigma, {1e-6, 0.1}, "rad",
             "standard deviation of the right camera's rotation about its optical axis, which is beforehand as likely "
             "as none; rows and disparities show it");
    list.add("right_delay", right_delay, {-0.1, 0.1}, "s",
             "time by which right images are known to be later than left ones; what it lacks is estimated");
    list.add("right_delay_sigma", right_delay_sigma, {1e-6, 0.1}, "s",
             "standard deviation of an error of that time, which is beforehand as likely as none");
  }
};

/// Estimate of the rig: a Kalman filter, in information form, over the windows of pairs and the rows of the features.
/// Windows overlap: one is part of the prior only for windows that share no pair with it.
///
/// The prior is a mixture with equal weights. The disparities' error is the options' value, or it is normally
/// distributed around that with `prior_sigma`. Roll and delay have the same prior, each with its own sigma.
/// Measurements shift the weights (Bayes factor), so what is compensated moves to the measured values without a
/// threshold.
class CalibrationFilter {
 public:
  /// Ratio between the information of a window and what it states: it counts points as if they erred independently
  /// (chosen by the errors of long drives).
  static constexpr double kHonest = 0.16 * 0.16;

  explicit CalibrationFilter(const CalibrationOptions& options);

  /// Process noise of `dt` s, in which the rig warms up or cools down, and its cameras' clocks drift.
  void predict(double dt);

  /// Estimate by the pairs before the window that begins with pair `oldest_id`: of the calibration that its disparities
  /// have while they are compensated for the present delay().
  CalibrationBelief prior(int oldest_id, const RigEstimate::Shape& shape) const;

  /// Notes the result of the window from pair `oldest_id` to `newest_id`, which had its prior(); `information` excludes
  /// that.
  void note(int oldest_id, int newest_id, const RigEstimate::Shape& shape, const RigCalibration& calibration,
            const RigCalibration::Matrix& information);

  /// Notes what rows have shown up to now of the roll, rad, or of the delay, s (RigEstimate::kRoll or kDelay), and its
  /// standard deviation.
  void noteRows(int parameter, double value, double sigma);

  /// Notes the square (px^2) of what a window found the calibration to leave at a point.
  void noteCommon(double square);

  /// The right camera rotated, which is compensated but for an error of this covariance, rad^2.
  void widen(const StereoCamera& camera, const Eigen::Matrix3d& rotation);

  /// Of the last window.
  const RigCalibration& calibration() const { return calibration_; }
  /// Estimate by the options, rows and all windows.
  RigEstimate estimate() const { return weigh(present_.value_or(Evidence())); }
  /// The delay that is compensated, s.
  double delay() const { return estimate().delay(); }
  bool hasWindow() const { return present_.has_value(); }

 private:
  /// Of measurements, the options' prior excluded.
  struct Evidence {
    RigEstimate::Matrix information = RigEstimate::Matrix::Zero();
    RigEstimate::Vector information_mean = RigEstimate::Vector::Zero();  ///< information * mean
  };

  const Evidence& pastBefore(int oldest_id) const;
  RigEstimate weigh(const Evidence& windows) const;
  void widen(const RigEstimate::Matrix& covariance);

  CalibrationOptions options_;
  RigCalibration calibration_;
  Evidence past_;     ///< of windows that share no pair with the present one
  Evidence pending_;  ///< of these and of one more, which is past to windows that begin after pair `pending_id_`
  int pending_id_ = -1;
  std::optional<Evidence> present_;                                     ///< of the past and the last window
  RigEstimate::Vector rows_ = RigEstimate::Vector::Zero();              ///< as rows show each alone
  RigEstimate::Vector rows_information_ = RigEstimate::Vector::Zero();  ///< 1/rad^2 and 1/s^2
  int commons_ = 0;                                                     ///< how many squares were noted
  double common_square_ = 0.0;
};

}  // namespace sdvo
