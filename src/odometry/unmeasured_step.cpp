#include <algorithm>

#include "odometry_state.hpp"

namespace sdvo {
namespace {

std::string missing(const StereoFeatures& features) {
  return "only " + std::to_string(features.count()) + " features" +
         (features.report.status.empty() ? "" : ": " + features.report.status);
}

/// Whether guesses move the pose: the pair has too few features, and the last measured one is recent.
bool canFollow(const VisualOdometryOptions& options, const StereoFeatures& features, const OdometryState& state) {
  const auto& followed = state.outage.followed();
  if (!state.map || !followed || features.count() >= options.motion.min_inliers) return false;
  const TrackingOptions& tracking = options.tracking;
  return state.map->secondsUntil(features) <= (followed->rotation_only ? tracking.max_gap : tracking.max_guessed);
}

/// Moves the pose by an unmeasured motion.
OdometryStep follow(const ExpectedMotion& expected, const std::string& reason, OdometryState& state) {
  OdometryStep step;
  step.state = TrackingState::kDegraded;
  step.reason = reason;
  step.T_previous_current = expected.motion;
  step.covariance = expected.covariance;
  state.covariance.predict(expected.motion, expected.covariance);
  return step;
}

}  // namespace

OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state) {
  OdometryStep step;
  state.interrupt();
  const auto followed = state.outage.followed();
  if (canFollow(options, features, state)) return follow(*followed, "motion by the guess: " + missing(features), state);
  if (features.count() < options.motion.min_inliers) {
    step.state = state.started ? TrackingState::kLost : TrackingState::kWaiting;
    step.reason = missing(features);
    return step;
  }
  const bool is_guessed = state.started && followed;
  const Eigen::Isometry3d T_previous_current = is_guessed ? followed->motion : Eigen::Isometry3d::Identity();
  state.seed.emplace(options.map);
  state.seed->insert(alignmentWith(options.noise), features, state.pairs,
                     (state.T_origin_camera * T_previous_current).inverse(), {}, state.rig.calibration.calibration());
  state.seed_has_pose = is_guessed && !followed->rotation_only;
  // The seed replaces a map from before the outage only when a pair is measured against it.
  const bool has_map = state.started && state.map && state.map->continuedBy(features);
  if (is_guessed) {
    step = follow(*followed,
                  std::string(has_map ? "not found in the map: goes on" : "started again") +
                      (followed->rotation_only ? " as the gyro turned; the translation is predicted"
                                               : " where the guess has the camera"),
                  state);
    if (has_map) return step;
    if (followed->rotation_only) ++state.epoch;
  } else if (has_map) {
    step.state = TrackingState::kLost;
    step.reason = "not found in the map: the next pair may be, or goes on from here";
    return step;
  } else if (state.started) {
    step.state = TrackingState::kDegraded;
    step.reason = kStartedAgain;
    state.startAgain();
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state.takeSeed();
  return step;
}

OdometryStep holdPose(double dt, OdometryState& state) {
  OdometryStep step;
  step.state = TrackingState::kDegraded;
  step.reason = state.images.comeTwice()
                    ? "each pair comes twice: is the driver's rate above the sensor's?"
                    : "the images repeat those of the previous pair although the camera moved: is the driver frozen?";
  step.T_previous_current = Eigen::Isometry3d::Identity();
  step.covariance = state.outage.last(state.prior, dt);
  state.covariance.predict(*step.T_previous_current, state.outage.growth(state.prior, dt));
  state.prior.interrupt();
  return step;
}

OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state) {
  const std::string reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state.prior.velocity() && dt <= options.tracking.max_gap &&
                           state.outage.predictedPairs() < options.tracking.max_predicted_pairs;
  // A gyro's guess has the translation's covariance around standstill; over one pair the prior's is smaller.
  if (canFollow(options, features, state) && !(can_predict && state.outage.followed()->rotation_only))
    return follow(*state.outage.followed(), "motion by the guess: " + reason, state);
  if (can_predict) {
    state.outage.countPrediction();
    return follow(state.prior.predicted(dt), "motion predicted: " + reason, state);
  }
  OdometryStep step = startMap(options, features, state);
  if (step.state == TrackingState::kLost) step.reason = reason;
  return step;
}

}  // namespace sdvo
