#pragma once

#include <optional>

#include "../motion/rig_calibration.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Kalman filter, in information form, of a rig's disparity error (offset, bend), right roll and right delay. Windows
/// of the map and rows of features measure them. Windows that share a pair replace each other.
///
/// The options' prior is a mixture with equal weights: the disparity error equals the options' value, or is normally
/// distributed around it with `prior_sigma`. The same holds for roll and delay, each with its own sigma. Measurements
/// shift the weights (Bayes factor), so no threshold decides what is compensated.
class CalibrationFilter {
 public:
  /// Ratio of a window's real information to the one that its adjustment reports. The adjustment takes errors of points
  /// for independent and reports 39 times too much (chosen by the errors of long drives).
  static constexpr double kRealInformation = 0.16 * 0.16;

  explicit CalibrationFilter(const CalibrationOptions& options);

  /// Adds the process noise of `dt` s, and returns it: the rig warms up or cools down, and its cameras' clocks drift.
  RigEstimate::Matrix predict(double dt);

  /// Calibration before a window's adjustment: estimate(), which knows what the same window showed up to its last pair.
  /// While one key frame stays, a prior without that would remain as wide as in the beginning, and the window would
  /// follow noise. The mean excludes the effect of delay(), for which disparities are compensated already.
  /// `calibration_by_rig`: RigEstimate::calibrationByRig().
  CalibrationBelief prior(const RigEstimate::CalibrationByRig& calibration_by_rig) const;

  /// Adds the window from pair `oldest_id` to `newest_id`. `calibration` includes the window's prior(), `information`
  /// (1/px^2) excludes it.
  void update(int oldest_id, int newest_id, const RigEstimate::CalibrationByRig& calibration_by_rig,
              const RigCalibration& calibration, const RigCalibration::Matrix& information);

  /// Sets the roll, rad, or the delay, s (RigEstimate::kRoll or kDelay), that all rows up to now imply, and its
  /// standard deviation. It replaces the value of the last call.
  void updateByRows(int parameter, double value, double sigma);

  /// Averages the variance, px^2, of the disparity error that all sightings of a point share, as a window estimates it.
  void updateCommon(double square);

  /// The right camera rotated, and features are rotated back. Adds the covariance of this rotation, rad^2, and returns
  /// it as the rig's.
  RigEstimate::Matrix widen(const StereoCamera& camera, const Eigen::Matrix3d& rotation);

  /// Result of the last window, px.
  const RigCalibration& calibration() const { return calibration_; }
  /// The rig that the last window compensated, and the second moment of estimate() around it.
  RigEstimate compensated() const;
  /// Estimate from the options, rows and all windows.
  RigEstimate estimate() const { return posterior(present_.value_or(Likelihood())); }
  /// The delay that is compensated, s.
  double delay() const { return estimate().delay(); }
  bool hasWindow() const { return present_.has_value(); }
  /// Whether the disparity's error is estimated, else held at the options' value.
  bool isEstimated() const { return options_.enabled; }

 private:
  /// Information of measurements, without the options' prior.
  struct Likelihood {
    RigEstimate::Matrix information = RigEstimate::Matrix::Zero();
    RigEstimate::Vector information_mean = RigEstimate::Vector::Zero();  ///< information * mean
  };

  /// Posterior of the rig: mean and covariance of a mixture of eight components, each with an error, or none, of
  /// disparity, roll and delay.
  RigEstimate posterior(const Likelihood& windows) const;
  RigEstimate::Matrix widen(const RigEstimate::Matrix& covariance);

  CalibrationOptions options_;
  RigCalibration calibration_;
  RigEstimate::Vector compensated_;  ///< the rig, by the last window
  Likelihood past_;                  ///< of windows that share no pair with the last one
  /// past_ and a window that ended with pair `next_past_id_`. It becomes past_ with the first window that begins later,
  /// as no pair is then counted twice.
  Likelihood next_past_;
  int next_past_id_ = -1;
  std::optional<Likelihood> present_;                                   ///< of past_ and the last window
  RigEstimate::Vector rows_ = RigEstimate::Vector::Zero();              ///< see updateByRows(): rad and s
  RigEstimate::Vector rows_information_ = RigEstimate::Vector::Zero();  ///< 1/rad^2 and 1/s^2
  int commons_ = 0;                                                     ///< number of updateCommon() calls, bounded
  double common_square_ = 0.0;
};

}  // namespace sdvo
