#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"

#include <cmath>
#include <sstream>

#include "stereo_descriptor_vo/odometry/motion_belief.hpp"

namespace sdvo {
namespace {

constexpr double kSigmas = 5.0;  // by which noise alone may exceed a limit

template <class... Parts>
PoseVerdict verdict(Trust trust, const Parts&... parts) {
  std::ostringstream reason;
  (reason << ... << parts);
  return {trust, reason.str()};
}

/// Standard deviation of a motion's translation (0) or rotation (3) in its worst direction, or a little more.
double deviation(const Matrix6d& covariance, int first) {
  return std::sqrt(covariance.block<3, 3>(first, first).trace());
}

/// Difference of two motions.
struct Change {
  double distance, angle;  ///< m, rad
};

Change changeOf(const Vector6d& difference) {
  return {difference.head<3>().norm(), difference.tail<3>().norm()};
}

Change changeOf(const Eigen::Isometry3d& difference) {
  return changeOf(logSE3(difference));
}

/// From the motion that the velocity before predicts.
Change changeSinceVelocity(const PoseEvidence& evidence) {
  return changeOf(logSE3(evidence.motion) - *evidence.velocity * evidence.dt);
}

/// By which a motion can differ from the predicted one when the velocity changes by so much (m/s, rad/s). The stamps of
/// both velocities may be wrong, and the motion has noise.
Change largestChange(const PoseVerdictOptions& options, const PoseEvidence& evidence, double speed_change,
                     double rate_change) {
  const double time = evidence.dt + options.stamp_tolerance, forgiven = 2.0 * options.stamp_tolerance;
  const Change before = changeOf(*evidence.velocity);
  return {speed_change * time + before.distance * forgiven + kSigmas * deviation(evidence.covariance, 0),
          rate_change * time + before.angle * forgiven + kSigmas * deviation(evidence.covariance, 3)};
}

}  // namespace

PoseVerdict judgePose(const PoseVerdictOptions& options, int min_inliers, const PoseEvidence& evidence) {
  const double time = evidence.dt + options.stamp_tolerance;
  const double noise = kSigmas * deviation(evidence.covariance, 0);
  const double turn_noise = kSigmas * deviation(evidence.covariance, 3);
  const double way = evidence.motion.translation().norm(), angle = logSE3(evidence.motion).tail<3>().norm();
  const double ratio = evidence.matches > 0 ? static_cast<double>(evidence.inliers) / evidence.matches : 0.0;

  // What no motion may be.
  if (evidence.inliers < min_inliers)
    return verdict(Trust::kNone, "only ", evidence.inliers, " of ", evidence.matches, " matches agree on one motion");
  if (ratio < options.doubtful_ratio / 3.0)
    return verdict(Trust::kNone, "only ", evidence.inliers, " of ", evidence.matches,
                   " matches agree on one motion, less than a third of tracking/doubtful_ratio");
  if (way > options.max_speed * time + noise)
    return verdict(Trust::kNone, "a speed of ", way / evidence.dt, " m/s exceeds tracking/max_speed");
  if (angle > options.max_rotation_rate * time + turn_noise)
    return verdict(Trust::kNone, "a rotation of ", angle / evidence.dt, " rad/s exceeds tracking/max_rotation_rate");

  // What a motion should not be.
  if (lastingDisagree(options, evidence))
    return verdict(Trust::kDoubtful, "only ", evidence.lasting_inliers, " of ", evidence.lasting_matches,
                   " lasting points (seen by four pairs) agree with the motion of ", evidence.inliers, " inliers");
  if (evidence.inliers < options.doubtful_inliers)
    return verdict(Trust::kDoubtful, "only ", evidence.inliers, " inliers");
  if (ratio < options.doubtful_ratio)
    return verdict(Trust::kDoubtful, "only ", evidence.inliers, " of ", evidence.matches, " matches are inliers");
  constexpr double kRatio = 0.03;  // of the distance (chosen)
  if (evidence.deviation > options.doubtful_deviation + kRatio * evidence.distance)
    return verdict(Trust::kDoubtful, "a distance of ", evidence.distance, " m with a standard deviation of ",
                   evidence.deviation, " m exceeds tracking/doubtful_deviation");
  return judgeChange(options, evidence);
}

PoseVerdict judgeChange(const PoseVerdictOptions& options, const PoseEvidence& evidence) {
  if (!evidence.velocity) return {};
  // What is long ago may have changed since.
  const Change most = largestChange(
      options, evidence,
      options.max_acceleration * (evidence.dt + options.stamp_tolerance) + kLastingAcceleration * evidence.velocity_age,
      options.max_rotation_acceleration * (evidence.dt + options.stamp_tolerance) +
          kLastingTurnAcceleration * evidence.velocity_age);
  if (evidence.guess) {
    const Change aside = changeOf(evidence.guess->inverse() * evidence.motion);
    if (aside.distance <= most.distance && aside.angle <= most.angle) return {};
  }
  const Change change = changeSinceVelocity(evidence);
  PoseVerdict doubt;
  if (change.distance > most.distance)
    doubt = verdict(Trust::kDoubtful, "a change of the motion by ", change.distance, " m in ", evidence.dt,
                    " s exceeds tracking/max_acceleration");
  else if (change.angle > most.angle)
    doubt = verdict(Trust::kDoubtful, "a change of the rotation by ", change.angle, " rad in ", evidence.dt,
                    " s exceeds tracking/max_rotation_acceleration");
  doubt.of_rate = doubt.trust == Trust::kDoubtful;
  return doubt;
}

bool lastingDisagree(const PoseVerdictOptions& options, const PoseEvidence& evidence) {
  return evidence.lasting_matches >= kEnoughLasting &&
         evidence.lasting_inliers < options.doubtful_lasting_ratio * evidence.lasting_matches;
}

bool lastingAgree(const PoseVerdictOptions& options, const PoseEvidence& evidence) {
  return evidence.lasting_matches >= kEnoughLasting && !lastingDisagree(options, evidence);
}

bool isImplausible(const PoseVerdictOptions& options, const PoseEvidence& evidence) {
  return judgeChange(options, evidence).trust == Trust::kDoubtful && !lastingAgree(options, evidence);
}

bool isUnexpected(const PoseEvidence& evidence) {
  if (!evidence.velocity) return false;
  const double age = evidence.velocity_age + evidence.dt;
  const Change change = changeSinceVelocity(evidence);
  return change.distance > kLastingAcceleration * age * evidence.dt ||
         change.angle > kLastingTurnAcceleration * age * evidence.dt;
}

}  // namespace sdvo
