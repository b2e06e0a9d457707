#include "map_update.hpp"

#include <utility>

namespace sdvo {
namespace {

/// Adjusts a copy of the map with the pair in it.
MapUpdate adjust(const std::optional<Floor>& floor, OdometryTools& tools, const SearchedPair& pair, bool may_recall,
                 OdometryState& state) {
  const StereoFeatures& features = pair.features;
  const MotionHypothesis& found = pair.found;
  const LocalMap& before = pair.scene->map;
  const Eigen::Isometry3d T_previous_origin = before.newestPose();
  state.candidate = before;
  LocalMap& map = *state.candidate;
  MapUpdate update;
  update.calibration = state.rig.calibration.calibration();
  update.delay = state.rig.calibration.delay();
  map.insert(features, state.pairs, found.motion.T_current_reference * T_previous_origin, found.sightings,
             update.calibration);
  update.T_keyframe_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && may_recall) tools.revisit.recall(features, update.calibration, map);
  // The adjustment has one calibration for all pairs: in it a delay acts at the window's mean rate of rotation.
  const auto [T_oldest_newest, seconds] = map.motionOfWindow();
  update.calibration_by_rig = RigEstimate::calibrationByRig(
      features.camera, logSO3(T_oldest_newest.linear()) / state.prior.interval(seconds, T_oldest_newest));
  update.adjustment =
      map.adjust(tools.optimizer, state.rig.calibration.prior(update.calibration_by_rig), update.calibration, floor);
  // The adjustment's covariance has the window's mean noise; this is the newest pair's against the rig's usual one.
  map.noteVariance(state.rig.noise.ofPair(update.adjustment.newest_square, update.adjustment.newest_measured));
  update.adjustment.since_keyframe *= map.varianceOfMotion();
  update.adjustment.growth *= map.varianceOfMotion();
  // The adjustment fixes the window's first pose: its error of height and tilt is corrected by moving the whole map.
  if (floor) map.moveTo(floor->settled(map.newestPose(), state.covariance.value()));
  map.renewAppearance(features, found.sightings);
  // A shift of the whole map by the adjustment is no motion.
  const Eigen::Isometry3d T_before_after = update.T_keyframe_origin.inverse() * map.poseBeforeNewest();
  update.motion = T_previous_origin * T_before_after * map.newestPose().inverse();
  update.distance = (map.poseBeforeNewest() * map.newestPose().inverse()).translation().norm();
  return update;
}

MapUpdate adjustBeyondDoubt(const VisualOdometryOptions& options, const std::optional<Floor>& floor,
                            OdometryTools& tools, SearchedPair& pair, OdometryState& state) {
  MotionHypothesis& found = pair.found;
  const MotionSearch& motions = tools.motions;
  const double most = largestDoubt(options.tracking);
  const bool is_sound = !state.doubt.lasts(), was_beyond_doubt = motions.isBeyondDoubt(found, most);
  MapUpdate update = adjust(floor, tools, pair, is_sound, state);
  const std::size_t adjusted = found.sightings.size();
  found.countInliers(update.adjustment.rejected);
  if (!was_beyond_doubt || motions.isBeyondDoubt(found, most)) return update;
  MotionScene scene = *pair.scene;
  scene.all_compete = true;
  MotionHypothesis chosen = motions.find(scene, most);
  if (!chosen.motion.success) return update;
  const Eigen::Isometry3d T_adjusted = std::exchange(found, std::move(chosen)).motion.T_current_reference;
  // Mostly the first motion prevails, and its adjustment is known.
  if (found.sightings.size() != adjusted || found.motion.T_current_reference.matrix() != T_adjusted.matrix())
    update = adjust(floor, tools, pair, is_sound, state);
  found.countInliers(update.adjustment.rejected);
  return update;
}

}  // namespace

MapUpdate updateMap(const VisualOdometryOptions& options, const std::optional<Floor>& floor, OdometryTools& tools,
                    SearchedPair& pair, OdometryState& state) {
  const MotionEstimate& motion = pair.found.motion;
  MapUpdate update;
  update.refusal = motion.reason;
  if (!motion.success) return update;
  const double since = pair.sinceReference();
  update.refusal = state.prior.tooFast(motion.T_current_reference.inverse(), motion.covariance, since);
  if (!update.refusal.empty()) return update;
  update = adjustBeyondDoubt(options, floor, tools, pair, state);
  update.refusal = tools.motions.chanceWords(*pair.scene, pair.found);
  if (update.refusal.empty()) update.refusal = state.prior.tooFast(update.motion, motion.covariance, since);
  update.success = update.refusal.empty();
  if (!update.success) update.refusal += " after the adjustment";
  return update;
}

}  // namespace sdvo
