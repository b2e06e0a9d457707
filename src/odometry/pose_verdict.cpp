#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"

#include <cmath>
#include <sstream>

#include "stereo_descriptor_vo/odometry/motion_doubt.hpp"

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
                   " lasting points agree with the motion of ", evidence.inliers, " inliers");
  if (!evidence.confirmed && evidence.inliers < options.doubtful_inliers)
    return verdict(Trust::kDoubtful, "only ", evidence.inliers, " inliers");
  if (!evidence.confirmed && ratio < options.doubtful_ratio)
    return verdict(Trust::kDoubtful, "only ", evidence.inliers, " of ", evidence.matches, " matches are inliers");
  if (!evidence.confirmed && evidence.coverage < options.doubtful_coverage)
    return verdict(Trust::kDoubtful, "inliers in only ", std::round(100.0 * evidence.coverage), " % of the image");
  if (!evidence.confirmed && evidence.rms > options.doubtful_rms)
    return verdict(Trust::kDoubtful, "a reprojection error of ", evidence.rms, " px");
  constexpr double kShare = 0.03;
  if (evidence.deviation > options.doubtful_deviation + kShare * way)
    return verdict(Trust::kDoubtful, "a way of ", way, " m known to ", evidence.deviation,
                   " m exceeds tracking/doubtful_deviation");
  return judgeChange(options, evidence);
}

PoseVerdict judgeChange(const PoseVerdictOptions& options, const PoseEvidence& evidence) {
  if (!evidence.velocity) return {};
  const Vector6d& before = *evidence.velocity;
  const double time = evidence.dt + options.stamp_tolerance;
  // The velocity before rests on stamps that may be wrong, too. What is long ago may have changed since.
  const double forgiven = 2.0 * options.stamp_tolerance;
  const double speed_change = options.max_acceleration * time + kLastingAcceleration * evidence.velocity_age;
  const double rate_change =
      options.max_rotation_acceleration * time + kLastingTurnAcceleration * evidence.velocity_age;
  const double most =
      speed_change * time + before.head<3>().norm() * forgiven + kSigmas * deviation(evidence.covariance, 0);
  const double most_turn =
      rate_change * time + before.tail<3>().norm() * forgiven + kSigmas * deviation(evidence.covariance, 3);
  if (evidence.guess) {
    const Vector6d aside = logSE3(evidence.guess->inverse() * evidence.motion);
    if (aside.head<3>().norm() <= most && aside.tail<3>().norm() <= most_turn) return {};
  }
  const Vector6d change = logSE3(evidence.motion) - before * evidence.dt;
  const double way = change.head<3>().norm(), angle = change.tail<3>().norm();
  PoseVerdict doubt;
  if (way > most)
    doubt = verdict(Trust::kDoubtful, "a change of the motion by ", way, " m in ", evidence.dt,
                    " s exceeds tracking/max_acceleration");
  else if (angle > most_turn)
    doubt = verdict(Trust::kDoubtful, "a change of the rotation by ", angle, " rad in ", evidence.dt,
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
  const Vector6d change = logSE3(evidence.motion) - evidence.dt * *evidence.velocity;
  return change.head<3>().norm() > kLastingAcceleration * age * evidence.dt ||
         change.tail<3>().norm() > kLastingTurnAcceleration * age * evidence.dt;
}

}  // namespace sdvo
