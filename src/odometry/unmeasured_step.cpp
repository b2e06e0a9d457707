#include "stereo_descriptor_vo/odometry/unmeasured_step.hpp"

#include <algorithm>

namespace sdvo {
namespace {

/// Whether a guess has the motion of a pair that shows nothing, not too long after the last one that did.
bool canFollow(const VisualOdometryOptions& options, const StereoFeatures& features, const OdometryState& state) {
  const auto& followed = state.outage.followed();
  if (!state.map || !followed || features.count() >= options.motion.min_inliers) return false;
  const TrackingOptions& tracking = options.tracking;
  return state.secondsSinceMap(features) <= (followed->rotation_only ? tracking.max_gap : tracking.max_guessed);
}

}  // namespace

OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state) {
  OdometryStep step;
  state.interrupt();
  if (features.count() < options.motion.min_inliers) {
    step.state = state.started ? TrackingState::kLost : TrackingState::kWaiting;
    step.reason = "only " + std::to_string(features.count()) + " features" +
                  (features.report.status.empty() ? "" : ": " + features.report.status);
    return step;
  }
  if (const auto& followed = state.outage.followed(); state.started && followed) {
    step.state = TrackingState::kDegraded;
    step.reason = followed->rotation_only ? "started again as the gyro turned; the translation is predicted"
                                          : "started again where the guess has the camera";
    if (followed->rotation_only) ++state.epoch;
    step.T_previous_current = followed->motion;
    step.covariance = followed->covariance;
    state.covariance.advance(*step.T_previous_current, step.covariance);
    state.covariance.assume(state.covariance.value());
  } else if (state.started) {
    ++state.epoch;
    const std::int64_t last = state.last_pose_stamp.value_or(features.stamp);
    const double unseen = static_cast<double>(features.stamp - last) * 1e-9;
    state.covariance.restart(state.prior.unseen(unseen));
    step.state = TrackingState::kDegraded;
    step.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state.started = true;
  state.interrupted = false;
  state.outage.end();
  state.map.emplace(options.map);
  const Eigen::Isometry3d T_previous_current = step.T_previous_current.value_or(Eigen::Isometry3d::Identity());
  state.map->insert(options.alignment, features, state.pairs, (state.T_origin_camera * T_previous_current).inverse(),
                    {}, state.rig.calibration.calibration());
  return step;
}

OdometryStep holdPose(double dt, OdometryState& state) {
  OdometryStep step;
  step.state = TrackingState::kDegraded;
  step.reason = "the images repeat those of the previous pair although the camera moved: is the driver frozen?";
  step.T_previous_current = Eigen::Isometry3d::Identity();
  step.covariance = state.outage.growth(state.prior, dt);
  state.covariance.advance(*step.T_previous_current, step.covariance);
  state.prior.interrupt();
  return step;
}

OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state) {
  OdometryStep step;
  step.reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state.prior.velocity() && dt <= options.tracking.max_gap &&
                           state.outage.predictedPairs() < options.tracking.max_predicted_pairs;
  ExpectedMotion expected;
  // The prior's translation over one pair is better than that around a standstill, which a gyro needs.
  if (canFollow(options, features, state) && !(can_predict && state.outage.followed()->rotation_only)) {
    expected = *state.outage.followed();
    step.reason = "motion by the guess: " + step.reason;
  } else if (can_predict) {
    state.outage.countPrediction();
    expected = state.prior.predicted(dt);
    step.reason = "motion predicted: " + step.reason;
  } else {
    state.interrupt();
    step.state = TrackingState::kLost;
    return step;
  }
  step.state = TrackingState::kDegraded;
  step.T_previous_current = expected.motion;
  step.covariance = expected.covariance;
  state.covariance.advance(*step.T_previous_current, step.covariance);
  return step;
}

}  // namespace sdvo
