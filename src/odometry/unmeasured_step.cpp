#include "stereo_descriptor_vo/odometry/unmeasured_step.hpp"

#include <algorithm>

namespace sdvo {
namespace {

/// Whether a guess has the motion of a pair that shows nothing, not too long after the last one that did.
bool canFollow(const VisualOdometryOptions& options, const StereoFeatures& features, const OdometryState& state) {
  const auto& followed = state.outage.followed();
  if (!state.map || !followed || features.count() >= options.motion.min_inliers) return false;
  const TrackingOptions& tracking = options.tracking;
  return state.map->secondsUntil(features) <= (followed->rotation_only ? tracking.max_gap : tracking.max_guessed);
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
  const auto& followed = state.outage.followed();
  if (state.started && followed) {
    step.T_previous_current = followed->motion;
    step.covariance = followed->covariance;
  }
  state.seed.emplace(options.map);
  const Eigen::Isometry3d T_previous_current = step.T_previous_current.value_or(Eigen::Isometry3d::Identity());
  state.seed->insert(options.alignment, features, state.pairs, (state.T_origin_camera * T_previous_current).inverse(),
                     {}, state.rig.calibration.calibration());
  step.state = state.started ? TrackingState::kDegraded : TrackingState::kTracking;
  if (!state.started) {
    step.reason = "first pair";
  } else if (followed) {
    step.reason = followed->rotation_only ? "started again as the gyro turned; the translation is predicted"
                                          : "started again where the guess has the camera";
    if (followed->rotation_only) ++state.epoch;
    state.covariance.advance(*step.T_previous_current, step.covariance);
    state.covariance.assume(state.covariance.value());
  } else if (state.map && state.map->continuedBy(features)) {
    step.state = TrackingState::kLost;
    step.reason = "not found in the map: the next pair may be, or goes on from here";
    return step;
  } else {
    step.reason = kStartedAgain;
    state.startAgain();
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
