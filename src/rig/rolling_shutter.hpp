#pragma once

#include <Eigen/Core>
#include <optional>

#include "../belief/motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Time at which row `v` (px) is taken after the stamp, in readouts: the middle one is taken at the stamp.
inline double rowTime(const StereoCamera& camera, double v) {
  return (v + 0.5) / camera.height - 0.5;
}

/// Velocity at a stamp, from the mean over the interval before it and over the one before that (RollingShutter).
template <class Velocity>
Velocity velocityAfter(const Velocity& mean_before, const Velocity& mean) {
  return mean + 0.25 * (mean - mean_before);
}

/// Velocity at a stamp to the fourth order, from the means over the two intervals before it and the two after it
/// (Colella and Woodward 1984).
template <class Velocity>
Velocity velocityAmong(const Velocity& before_last, const Velocity& last, const Velocity& next,
                       const Velocity& after_next) {
  return (7.0 * (last + next) - (before_last + after_next)) / 12.0;
}

/// How a position in the left image depends on the pair's motion.
struct LeftResidual {
  Eigen::Matrix<double, 2, 6> by_pose;  ///< derivative of the projection by the motion's left perturbation
  Eigen::Vector2d value;                ///< measured - projected, px
};
/// Of a point of the reference under T_current_reference; none if it is not in front of the camera.
std::optional<LeftResidual> leftResidual(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                         const Eigen::Vector3d& point, const Eigen::Vector2d& measured);

/// Rate of the camera's rotation at the stamp, rad/s about its axes, by the rows of one pair against the map.
struct RateByRows {
  Eigen::Vector3d value;
  Eigen::Matrix3d covariance;  ///< of the pair's noise alone
  /// Derivative of the pair's motion (its left perturbation, m and rad) by the rate with which rows are moved.
  Eigen::Matrix<double, 6, 3> motion_by_rate;
};

/// A pair as a rolling shutter took it, with the camera's velocities in its own frame, m/s and rad/s.
struct RolledPair {
  StereoFeatures features;
  double readout = 0.0;                            ///< s, see RollingShutter
  Vector6d velocity = Vector6d::Zero();            ///< at the stamp; rows are moved by it
  std::optional<Vector6d> mean_velocity{};         ///< over the interval before; none if unknown
  std::optional<Vector6d> mean_velocity_before{};  ///< over the interval before that one
  double dt = 0.0;                                 ///< s, of the interval before
  std::optional<RateByRows> rate_by_rows{};

  /// Keeps the features only: no velocity is measured.
  void forgetMotion() { mean_velocity.reset(), mean_velocity_before.reset(), rate_by_rows.reset(); }
};

/// Compensation of a rolling shutter. Its rows are taken one after the other: the middle one at the stamp, left and
/// right ones at the same time.
///
/// Motions between pairs are mean velocities. Under white acceleration of the variance a^2 per second, the velocity at
/// a pair less the mean before it has the variance a^2 dt / 3, the last change of the mean 2/3 a^2 dt, and both the
/// covariance a^2 dt / 6. So the best estimate is that mean plus a quarter of the change, to 7/24 a^2 dt. Once the
/// next motion is known, the velocity is the mean of both motions', with the variance a^2 dt / 6.
/// Rows measure the rate at the pair itself, even in a tremor faster than pairs, but against the map. If pairs of the
/// map were moved by this rate, its error would grow from pair to pair. So only the newest pair uses it, until the next
/// motion is known.
class RollingShutter {
 public:
  /// `rotation_acceleration`: a, standard deviation of the rate's change in 1 s, rad/s, until motions are learnt.
  RollingShutter(const CalibrationOptions& options, double rotation_acceleration)
      : acceleration_square_(rotation_acceleration * rotation_acceleration) {
    begin(options);
  }

  /// For another camera: the options' readout is used, or 0 until one is estimated. The learnt acceleration stays.
  void begin(const CalibrationOptions& options) {
    readout_ = options.readout;
    is_estimated_ = options.enabled && readout_ == 0.0;
  }

  /// s, from the first row to the last; negative if the last row is the first one taken.
  double readout() const { return readout_; }
  /// Whether takeEstimate() sets the readout.
  bool isEstimated() const { return is_estimated_; }
  void takeEstimate(double readout) { readout_ = readout; }
  bool isRolling() const { return readout_ != 0.0; }

  /// The features as a global shutter would have seen them at the stamp.
  static StereoFeatures asGlobal(const RolledPair& pair);

  /// Whether a difference between two velocities moves no row by more than a part of its noise. Only the rotations
  /// count: translations move far points less.
  bool isNegligible(const StereoCamera& camera, const Vector6d& difference) const;

  /// Rate by the inliers of the motion that was found with asGlobal(`pair`). None if they do not constrain it.
  std::optional<RateByRows> rateByRows(const RolledPair& pair, const MotionHypothesis& found) const;

  /// Velocity at the newest pair. Without a known motion the translation is unknown, and zero.
  Vector6d velocityAt(const RolledPair& pair) const;
  /// The same once the mean velocity `next` over the interval after the pair is known.
  Vector6d velocityBetween(const RolledPair& pair, const Vector6d& next) const;
  /// Covariance of the pair's motion, m and rad, by the error of velocityAt().
  Matrix6d covarianceByVelocity(const RolledPair& pair) const;

  /// Adds a pair, and the mean velocity after it, to the estimate of a.
  void learn(const RolledPair& pair, const Vector6d& next);

 private:
  /// Variance of the rate of velocityAt() without rows, rad^2/s^2.
  double varianceAt(const RolledPair& pair) const;

  bool is_estimated_ = false;
  double readout_ = 0.0;
  double acceleration_square_;  ///< a^2, rad^2/s^3
  double learnt_pairs_ = 0.0;   ///< number of learn() calls, bounded
};

}  // namespace sdvo
