#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

#include "../motion/noise.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

/// Normal distribution of a motion; the covariance is of a right perturbation, m and rad.
struct ExpectedMotion {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();

  /// Right perturbation, m and rad, from this motion to a measured one.
  Vector6d innovation(const Eigen::Isometry3d& measured) const { return logSE3(motion.inverse() * measured); }
  /// Its squared Mahalanobis distance: chi-square of six if the measured motion is of this distribution.
  double normalisedSquare(const Eigen::Isometry3d& measured, const Matrix6d& measured_covariance) const;
};

/// Distribution of the next motion: constant velocity with white acceleration, errors of stamps, and a velocity that
/// grows uncertain with age. The velocity of the last measured pair predicts the next motion. The last confirmed one
/// gives the prior that measured motions are compared with.
class MotionPrior {
 public:
  explicit MotionPrior(const MotionPriorOptions& options) : options_(options) {}

  void configure(const MotionPriorOptions& options) { options_ = options; }

  /// Notes the time since the previous pair, s. Leave out gaps over which no motion is predicted (max_gap).
  void noteInterval(double dt);

  /// Last measured velocity in the camera's frame, m/s and rad/s; none where no motion can be predicted.
  std::optional<Vector6d> velocity() const { return last_ ? std::optional(last_->value) : std::nullopt; }

  /// Duration of a motion, s, between pairs whose stamps are `dt` s apart. It is longer than `dt` for a burst, whose
  /// stamps lie closer together than its exposures, and where the motion would exceed max_speed or
  /// max_rotation_rate.
  double interval(double dt, const Eigen::Isometry3d& motion) const;

  /// The next motion, over `dt` s. velocity() must be known.
  ExpectedMotion predicted(double dt) const;

  /// Prior of the motion over `dt` s after `stamp`, ns, by the confirmed velocity. None without one, or if it is so old
  /// that its error exceeds the distance at max_speed over max_gap.
  std::optional<ExpectedMotion> priorByConfirmed(std::int64_t stamp, double dt) const;

  /// Distribution around another source's motion over `dt` s, with the process noise of a prediction over one pair.
  ExpectedMotion around(const Eigen::Isometry3d& motion, double dt) const;

  /// Log-likelihood ratio that two pairs came in the wrong order, from the last motion and this one, over `dt` s. In
  /// wrong order the last motion skips a pair, and this one leads back to it.
  double logRatioOfSwap(const Eigen::Isometry3d& motion, double dt) const;

  /// Covariance, m^2 and rad^2, of the motion over so many seconds without images; its mean is standstill. It starts at
  /// the confirmed speed in any direction. The distance at max_speed and half a turn bound it.
  Matrix6d outageCovariance(double seconds) const;

  /// Covariance of the motion in the last `dt` s of these alone. The distance at max_speed and the angle at
  /// max_rotation_rate over `dt` bound it.
  Matrix6d lastStepCovariance(double seconds, double dt) const;

  /// Covariance, m^2 and rad^2, of a motion that nothing measures. The standard deviations are the distance at
  /// max_speed over max_gap, and half a radian.
  Matrix6d unmeasuredCovariance() const;

  /// Reason, if a motion over `dt` s exceeds a limit by more than its noise and stamps allow; else empty.
  std::string tooFast(const Eigen::Isometry3d& motion, const Matrix6d& covariance, double dt) const;

  /// Takes over the velocity of a motion up to `stamp`, ns, over so many seconds `by_stamps`. A doubtful motion leaves
  /// the confirmed velocity as it is, unless there is none. `doubt`: its covariance, m and rad, beyond the measured
  /// one, which widens the next prediction.
  void takeVelocity(std::int64_t stamp, const Eigen::Isometry3d& motion, double by_stamps, const Matrix6d& covariance,
                    bool is_confirmed, const Matrix6d& doubt);

  /// The next pair does not continue the last one: no motion is predicted. The confirmed velocity stays.
  void interrupt() { last_.reset(), before_last_.reset(), doubt_.setZero(); }

 private:
  struct Velocity {
    Vector6d value;       ///< m/s and rad/s
    Matrix6d covariance;  ///< of its measurement
    double interval;      ///< s, over which it was measured
    std::int64_t stamp;   ///< ns, at the interval's end
  };

  /// Duration of a motion between stamps `dt` s apart: for a burst the longest recent one.
  double interval(double dt) const;
  /// Covariance, m^2 and rad^2, of a motion over `dt` s under white acceleration. Its prediction is a mean velocity
  /// over `before` s, an interval that ended `age` s earlier.
  Matrix6d processNoise(double dt, double before, double age) const;
  /// s: an interval between two stamps is not longer; the acceleration had so much time.
  double withStampErrors(double dt) const { return dt + 2.0 * options_.stamp_sigma; }
  Matrix6d stampNoise(const Vector6d& velocity) const;

  MotionPriorOptions options_;
  std::optional<Velocity> last_, before_last_, confirmed_;
  Matrix6d doubt_ = Matrix6d::Zero();  ///< see takeVelocity(): m and rad
  double longest_interval_ = 0.0;      ///< s, decaying maximum of the intervals
  double mean_interval_ = 0.0;         ///< s, running mean
  double counted_intervals_ = 0.0;     ///< number of intervals in the mean, bounded
};

/// Second moment of a difference between motions. Each direction of translation, and of rotation, gets the whole
/// squared length: an upper bound.
Matrix6d momentOf(const Vector6d& difference);

}  // namespace sdvo
