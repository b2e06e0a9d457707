#include "odometry_state.hpp"

namespace sdvo {
namespace {

std::string missing(const StereoFeatures& features) {
  return "only " + std::to_string(features.count()) + " features" +
         (features.report.status.empty() ? "" : ": " + features.report.status);
}

/// Whether guesses move the pose: the pair has too few features, and the last measured one is recent.
bool canUseGuesses(const VisualOdometryOptions& options, const StereoFeatures& features, const OdometryState& state) {
  const auto& guessed = state.outage.guessedMotion();
  if (!state.map || !guessed || features.count() >= options.motion.min_inliers) return false;
  const TrackingOptions& tracking = options.tracking;
  return state.map->secondsUntil(features) <= (guessed->rotation_only ? tracking.max_gap : tracking.max_guessed);
}

/// Moves the pose by an unmeasured motion.
OdometryStep stepBy(const ExpectedMotion& expected, const std::string& reason, OdometryState& state) {
  OdometryStep step;
  step.state = TrackingState::kDegraded;
  step.reason = reason;
  step.T_previous_current = expected.motion;
  step.covariance = expected.covariance;
  state.covariance.predict(expected.motion, expected.covariance);
  return step;
}

OdometryStep stepWithoutMotion(TrackingState tracking, const std::string& reason) {
  OdometryStep step;
  step.state = tracking;
  step.reason = reason;
  return step;
}

}  // namespace

/// In this order:
///   few features, a guess:      the pose goes on by the guess           DEGRADED
///   few features, none:         nothing                                 WAITING, after the first map LOST
///   a guess, with a map:        the guess; the map stays                DEGRADED
///   a guess, no map:            the fallback map, at the guess          DEGRADED; by a gyro alone another epoch
///   no guess, with a map:       nothing; the map stays                  LOST
///   no guess, no map:           the fallback map, at the last pose      DEGRADED in another epoch; at first TRACKING
OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state) {
  state.interrupt();
  const auto guessed = state.outage.guessedMotion();
  if (canUseGuesses(options, features, state))
    return stepBy(*guessed, "motion by the guess: " + missing(features), state);
  if (features.count() < options.motion.min_inliers)
    return stepWithoutMotion(state.started ? TrackingState::kLost : TrackingState::kWaiting, missing(features));

  const bool is_guessed = state.started && guessed;
  const Eigen::Isometry3d T_previous_current = is_guessed ? guessed->motion : Eigen::Isometry3d::Identity();
  state.fallback_map.emplace(options.map);
  state.fallback_map->insert(features, state.pairs, (state.T_origin_camera * T_previous_current).inverse(), {},
                             state.rig.calibration.calibration());
  state.fallback_keeps_epoch = is_guessed && !guessed->rotation_only;

  // The fallback map replaces a map from before the outage only when a pair is measured against it.
  const bool has_map = state.started && state.map && state.map->continuedBy(features);
  if (is_guessed) {
    OdometryStep step = stepBy(*guessed,
                               std::string(has_map ? "not found in the map: goes on" : "started again") +
                                   (guessed->rotation_only ? " as the gyro turned; the translation is predicted"
                                                           : " where the guess has the camera"),
                               state);
    if (has_map) return step;
    step.changes_epoch = guessed->rotation_only;  // the position is not known
    if (step.changes_epoch) ++state.epoch;
    state.useFallbackMap();
    return step;
  }
  if (has_map)
    return stepWithoutMotion(TrackingState::kLost, "not found in the map: the next pair may be, or goes on from here");
  const bool starts_again = state.started;
  if (starts_again) state.startAgain();
  state.useFallbackMap();
  return starts_again ? stepWithoutMotion(TrackingState::kDegraded, kStartedAgain)
                      : stepWithoutMotion(TrackingState::kTracking, "first pair");
}

OdometryStep holdPose(double dt, OdometryState& state) {
  OdometryStep step;
  step.state = TrackingState::kDegraded;
  step.reason = state.images.comeTwice()
                    ? "each pair comes twice: is the driver's rate above the sensor's?"
                    : "the images repeat those of the previous pair although the camera moved: is the driver frozen?";
  step.T_previous_current = Eigen::Isometry3d::Identity();
  // Velocities of successive steps are correlated. So the pose's covariance grows by the difference of the outage's
  // totals after and before the step; the motion has that of the step alone.
  step.covariance = state.prior.lastStepCovariance(state.outage.seconds(), dt);
  state.covariance.predict(*step.T_previous_current, state.outage.growth(state.prior, dt));
  state.prior.interrupt();
  return step;
}

OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state) {
  const std::string reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state.prior.velocity() && dt <= options.tracking.max_gap &&
                           state.outage.predictedPairs() < options.tracking.max_predicted_pairs;
  // A gyro measures no translation: the guess then has the covariance of an outage around standstill. Over one pair a
  // prediction has the smaller one.
  if (canUseGuesses(options, features, state) && !(can_predict && state.outage.guessedMotion()->rotation_only))
    return stepBy(*state.outage.guessedMotion(), "motion by the guess: " + reason, state);
  if (can_predict) {
    state.outage.countPrediction();
    return stepBy(state.prior.predicted(dt), "motion predicted: " + reason, state);
  }
  OdometryStep step = startMap(options, features, state);
  if (step.state == TrackingState::kLost) step.reason = reason;
  return step;
}

}  // namespace sdvo
