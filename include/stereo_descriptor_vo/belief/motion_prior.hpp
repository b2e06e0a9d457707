#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {

struct MotionPriorOptions {
  double max_speed = 70.0;
  double max_rotation_rate = 6.3;
  double acceleration = 2.2;
  double rotation_acceleration = 1.4;
  double stamp_sigma = 0.005;
  double max_gap = 1.0;

  void describe(OptionList& list) {
    list.add("max_speed", max_speed, {0.1, 1000.0}, "m/s", "a faster motion is a wrong one");
    list.add("max_rotation_rate", max_rotation_rate, {0.1, 100.0}, "rad/s", "a faster rotation is a wrong one");
    list.add("acceleration", acceleration, {0.01, 1000.0}, "m/s",
             "standard deviation, in each direction, of the velocity's change within a second: white acceleration, so "
             "half of it in a quarter of the time");
    list.add("rotation_acceleration", rotation_acceleration, {0.01, 1000.0}, "rad/s",
             "the same for the rate of rotation");
    list.add("stamp_sigma", stamp_sigma, {0.0, 1.0}, "s", "standard deviation of a stamp's error");
    list.add("max_gap", max_gap, {0.01, 60.0}, "s", "longest time between pairs over which the motion is predicted");
  }
};

/// A motion with the covariance of a right perturbation, m and rad.
struct ExpectedMotion {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  Matrix6d covariance = Matrix6d::Zero();

  /// How far another motion, which has a covariance of its own, is from it.
  Vector6d innovation(const Eigen::Isometry3d& measured) const { return logSE3(motion.inverse() * measured); }
  /// The square of that in standard deviations: chi-square of six where it is such a motion.
  double normalisedSquare(const Eigen::Isometry3d& measured, const Matrix6d& measured_covariance) const;
};

/// How the camera goes on: constant velocity with white acceleration, stamps with an error, and velocities that are
/// less certain the older they are. The velocity of the last measured pair predicts the next motion; the last confirmed
/// one is the distribution that motions are compared with.
class MotionPrior {
 public:
  explicit MotionPrior(const MotionPriorOptions& options) : options_(options) {}

  void configure(const MotionPriorOptions& options) { options_ = options; }

  /// Takes note of the time since the pair before, s. Gaps longer than that over which motions are predicted are none.
  void noteInterval(double dt);

  /// Of the camera in its own frame, m/s and rad/s; none where no motion can be predicted.
  const std::optional<Vector6d>& velocity() const { return velocity_; }

  /// Duration of a motion, s, between pairs whose stamps are `dt` s apart. It is longer than `dt` for a burst, whose
  /// stamps lie closer together than its exposures, and where the motion would exceed max_speed or
  /// max_rotation_rate.
  double interval(double dt, const Eigen::Isometry3d& motion) const;

  /// The next motion as the velocity, which must be known, predicts it.
  ExpectedMotion predicted(double dt) const;

  /// Of the motion over `dt` s from the moment `stamp` on, ns, by the confirmed velocity. None where there was none,
  /// and where it is so long ago that its error exceeds any distance between two pairs (max_speed times max_gap).
  std::optional<ExpectedMotion> confirmed(std::int64_t stamp, double dt) const;

  /// The same around a motion that another source measured, whose error is as a prediction's within one pair.
  ExpectedMotion around(const Eigen::Isometry3d& motion, double dt) const;

  /// By how much (logarithm of the ratio) the last motion and this one, over `dt` s, are likelier if their pairs
  /// changed places. The first one then seems twice as far, and the second one behind it.
  double logRatioOfSwap(const Eigen::Isometry3d& motion, double dt) const;

  /// Of an unseen motion around a standstill, m and rad: its speed was that of the confirmed velocity, and is bounded.
  Matrix6d unseen(double seconds) const;

  /// Covariance, m^2 and rad^2, of a motion without any measurement. The standard deviations are the distance at
  /// max_speed over max_gap, and half a radian.
  Matrix6d unknown() const;

  /// In words, if no motion may be as fast, noise and stamps considered.
  std::string tooFast(const Eigen::Isometry3d& motion, const Matrix6d& covariance, double dt) const;

  /// Takes over the velocity of a measured motion. One in doubt predicts the next pair, but confirms nothing; what it
  /// is doubted by makes the prediction as uncertain.
  void takeVelocity(std::int64_t stamp, const Eigen::Isometry3d& motion, double dt, const Matrix6d& covariance,
                    bool is_confirmed, const Matrix6d& doubt);

  /// The next pair does not continue the last one: no motion is predicted. The confirmed velocity stays.
  void interrupt() { velocity_.reset(), before_.reset(), doubt_.setZero(); }

 private:
  /// Covariance, m^2 and rad^2, of a motion over `dt` s under white acceleration. The prediction is the mean velocity
  /// over `before` s, an interval that ended `age` s earlier.
  Matrix6d processNoise(double dt, double before, double age) const;
  Matrix6d stampNoise(const Vector6d& velocity) const;

  MotionPriorOptions options_;
  std::optional<Vector6d> velocity_, before_,
      confirmed_;  ///< m/s and rad/s; `before_` is of the motion before the last
  Matrix6d velocity_covariance_ = Matrix6d::Zero(), confirmed_covariance_ = Matrix6d::Zero();
  Matrix6d doubt_ = Matrix6d::Zero();                          ///< of the last measured motion, m and rad
  std::int64_t confirmed_stamp_ = 0;                           ///< ns
  double velocity_interval_ = 0.0, confirmed_interval_ = 0.0;  ///< s, over which the velocities were measured
  double interval_ = 0.0;                                      ///< s: about the longest of the last intervals
};

/// The second moment of a difference between motions, the same in every direction of its translation and rotation.
Matrix6d momentOf(const Vector6d& difference);

}  // namespace sdvo
