#include <cmath>
#include <utility>

#include "../common/text.hpp"
#include "map_update.hpp"

namespace sdvo {
namespace {

/// Second moment of an innovation that chance does not explain: stamps may be wrong, or the camera did what none does.
Matrix6d unexpected(const SearchedPair& pair) {
  if (!(pair.found.innovation > noiseGate(6))) return Matrix6d::Zero();
  const Vector6d innovation = pair.scene->prior.front().innovation(pair.found.motion.T_current_reference.inverse());
  return innovation * innovation.transpose();
}

/// The candidate, a copy of the scene's map with the pair, becomes the map: a fallback or earlier map, too. Points of a
/// mover agree with each other: a doubtful pair confirms none.
void takeMap(const MapUpdate& update, bool is_doubtful, OdometryState& state) {
  std::swap(state.map, state.candidate);
  if (is_doubtful) state.map->discountNewest();
  const LocalMap::Adjustment& adjustment = update.adjustment;
  if (!adjustment.success) return;
  state.rig.calibration.update(state.map->oldestId(), state.map->newestId(), update.calibration_by_rig,
                               update.calibration, adjustment.calibration_information);
  if (is_doubtful) return;
  state.rig.noise.learnPair(adjustment.newest_square);
  if (adjustment.common_disparity_square) state.rig.calibration.updateCommon(*adjustment.common_disparity_square);
}

/// The motion between the two reported poses, and its covariance.
OdometryStep measure(const MotionHypothesis& found, const MapUpdate& update, OdometryState& state) {
  const LocalMap& map = *state.map;
  const LocalMap::Adjustment& adjustment = update.adjustment;
  OdometryStep step;
  step.rejected_features = adjustment.rejected;
  step.T_previous_current = (map.newestPose() * state.T_origin_camera).inverse();
  if (!adjustment.success) {
    // It is measured against the map's points all the same.
    step.covariance = state.covariance.update(*step.T_previous_current, found.motion.covariance);
    return step;
  }
  step.covariance = state.covariance.update(*step.T_previous_current, adjustment.since_keyframe, adjustment.growth);
  const Matrix6d by_rig = state.covariance.updateExposure(
      adjustment.by_calibration * update.calibration_by_rig, state.rig.calibration.estimate(),
      RigEstimate::of(*state.map_camera, update.calibration, update.delay));
  // The motion between two reported poses includes the map's correction of the first one. It is found as a perturbation
  // of the key frame, and reported as one of the newest pair.
  step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                    logSE3(update.T_keyframe_origin * map.poseBeforeNewest().inverse());
  state.covariance.coverCorrection(step.correction);
  const bool by_chance = mahalanobisSquare(step.correction, step.covariance) <= noiseGate(6);
  step.covariance += missingCovariance(step.covariance, step.correction) + by_rig;
  if (by_chance) return step;
  step.reason = text(4, "the map corrected the pose by ", step.correction.head<3>().norm(), " m and ",
                     step.correction.tail<3>().norm(), " rad");
  return step;
}

/// Adds second moments to the covariances: of rivals, of places that look alike, and of an unexpected innovation. A
/// doubtful motion has the moment of its doubt as well.
void widen(const SearchedPair& pair, const Belief& belief, bool is_doubtful, OdometryStep& step, OdometryState& state) {
  const auto add = [&](const Matrix6d& motion, const Matrix6d& pose) {
    step.covariance += motion;
    state.covariance.addDoubt(motion, pose);
  };
  add(pair.found.rivals_moment, pair.found.rivals_moment);
  add(unexpected(pair), Matrix6d::Zero());  // stamps change the velocity, not the pose
  if (is_doubtful) add(belief.moment, belief.pose_moment);
  if (!pair.scene->place) return;
  const Matrix6d of_places = pair.scene->place->mixture.moment();
  step.covariance += of_places;
  state.covariance.inflate(of_places);
}

/// Reason, if the covariance since the last key frame is too large; else empty.
std::string deviationWords(const TrackingOptions& tracking, const SearchedPair& pair, const MapUpdate& update) {
  const std::optional<PlaceBelief>& place = pair.scene->place;
  Matrix6d covariance = update.adjustment.since_keyframe + unexpected(pair);
  if (place) covariance += place->mixture.moment();
  const double deviation = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  if (deviation <= tracking.doubtful_deviation + kTolerableRatio * update.distance) return "";
  const std::string words = pair.found.innovation > noiseGate(6)
                                ? innovationWords(pair.found)
                                : text(3, "a distance of ", update.distance, " m with a standard deviation of ",
                                       deviation, " m exceeds tracking/doubtful_deviation");
  return words + (place ? ": " + place->mixture.cause() : "");
}

}  // namespace

OdometryStep measuredStep(const VisualOdometryOptions& options, const std::optional<Floor>& floor,
                          const SearchedPair& pair, const MapUpdate& update, const std::vector<Evidence>& evidence,
                          OdometryState& state) {
  const MotionHypothesis& found = pair.found;
  const double since = pair.sinceReference();  // takeMap() changes the scene's map
  const bool starts_again = pair.in_fallback_map && !state.fallback_keeps_epoch;
  if (starts_again) state.startAgain();
  if (pair.in_earlier_map) state.returnToEarlierMap();
  if (pair.in_fallback_map) state.covariance.beginMap();  // startAgain() has done it already, the guess has not
  const Belief belief = state.doubt.update(*pair.scene, found, evidence);
  const bool is_doubtful = belief.probability < options.tracking.probability;
  // The calibration is taken from every adjusted pair. Doubtful ones confirm no points and teach no noise; those too
  // uncertain do, but confirm no velocity.
  takeMap(update, is_doubtful, state);
  OdometryStep step = measure(found, update, state);
  const Matrix6d measured = step.covariance;
  widen(pair, belief, is_doubtful, step, state);
  const std::string doubt = is_doubtful ? belief.reason : deviationWords(options.tracking, pair, update);
  step.state = doubt.empty() && !starts_again ? TrackingState::kTracking : TrackingState::kDegraded;
  step.probability = belief.probability;
  step.changes_epoch = starts_again || pair.in_earlier_map;
  if (!doubt.empty()) step.reason = "doubtful: " + doubt;
  // A motion that is probably not the camera's predicts nothing.
  if (belief.probability >= 0.5)
    state.prior.takeVelocity(pair.features.stamp, found.motion.T_current_reference.inverse(), since, measured,
                             doubt.empty(), step.covariance - measured);
  if (floor) {
    const std::string off = state.floor.note(*floor, state.map->newestPose(), update.motion);
    if (step.reason.empty()) step.reason = off;
  }
  if (state.interrupted) {
    const std::string end = starts_again ? kStartedAgain
                            : pair.in_fallback_map
                                ? "goes on where the guess had the camera"
                                : "re-acquired by " + std::to_string(found.agreement.inliers) + " points of the map";
    step.reason = end + (step.reason.empty() ? "" : "; " + step.reason);
  }
  state.endOutage(pair.in_earlier_map);
  if (state.map->newestIsKeyframe()) state.covariance.markKeyframe();
  return step;
}

}  // namespace sdvo
