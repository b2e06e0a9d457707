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
  /// Factor on the information that a window's adjustment reports. The adjustment assumes independent errors of points,
  /// so it is overconfident (chosen by the errors of long drives).
  static constexpr double kHonest = 0.16 * 0.16;

  explicit CalibrationFilter(const CalibrationOptions& options);

  /// Adds the process noise of `dt` s, and returns it: the rig warms up or cools down, and its cameras' clocks drift.
  RigEstimate::Matrix predict(double dt);

  /// Calibration before a window's adjustment: estimate(), which has the window up to its last pair. Without it, a rig
  /// without error keeps half of the options' prior for as long as one key frame stays, and the window follows noise.
  /// The mean excludes the effect of delay(), for which disparities are compensated already. `shape`: derivative of the
  /// calibration by the rig.
  CalibrationBelief prior(const RigEstimate::Shape& shape) const;

  /// Adds the window from pair `oldest_id` to `newest_id`. `calibration` includes the window's prior(), `information`
  /// (1/px^2) excludes it.
  void note(int oldest_id, int newest_id, const RigEstimate::Shape& shape, const RigCalibration& calibration,
            const RigCalibration::Matrix& information);

  /// Sets the roll, rad, or the delay, s (RigEstimate::kRoll or kDelay), that all rows up to now imply, and its
  /// standard deviation. It replaces the value of the last call.
  void noteRows(int parameter, double value, double sigma);

  /// Averages the variance, px^2, of the disparity error that all sightings of a point share, as a window estimates it.
  void noteCommon(double square);

  /// The right camera rotated, and features are rotated back. Adds the covariance of this rotation, rad^2, and returns
  /// it as the rig's.
  RigEstimate::Matrix widen(const StereoCamera& camera, const Eigen::Matrix3d& rotation);

  /// Result of the last window, px.
  const RigCalibration& calibration() const { return calibration_; }
  /// The rig that the last window compensated, and the second moment of estimate() around it.
  RigEstimate used() const;
  /// Estimate from the options, rows and all windows.
  RigEstimate estimate() const { return weigh(present_.value_or(Likelihood())); }
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

  const Likelihood& pastBefore(int oldest_id) const;
  RigEstimate weigh(const Likelihood& windows) const;
  RigEstimate::Matrix widen(const RigEstimate::Matrix& covariance);

  CalibrationOptions options_;
  RigCalibration calibration_;
  RigEstimate::Vector used_;  ///< by the last window
  Likelihood past_;           ///< of windows that share no pair with the last one
  Likelihood pending_;        ///< of past_ and a window up to pair `pending_id_`: past of windows that begin later
  int pending_id_ = -1;
  std::optional<Likelihood> present_;                                   ///< of past_ and the last window
  RigEstimate::Vector rows_ = RigEstimate::Vector::Zero();              ///< see noteRows(): rad and s
  RigEstimate::Vector rows_information_ = RigEstimate::Vector::Zero();  ///< 1/rad^2 and 1/s^2
  int commons_ = 0;                                                     ///< number of noteCommon() calls, bounded
  double common_square_ = 0.0;
};

}  // namespace sdvo
