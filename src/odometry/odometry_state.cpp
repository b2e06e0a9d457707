#include "odometry_state.hpp"

#include <algorithm>
#include <utility>

#include "pair_search.hpp"

namespace sdvo {
namespace {

LearntRig unknownRig(const VisualOdometryOptions& options) {
  return {options.calibration, options.noise};
}

/// Reports matches, inliers, and their coverage and residual.
void reportMatches(const SearchedPair& pair, const std::vector<int>& rejected, OdometryResult& result) {
  const MotionHypothesis& found = pair.found;
  result.flow.reserve(found.matches.size());
  for (const FeatureMatch& match : found.matches) {
    const cv::Point3f& previous = found.view->pixels[match.reference];
    const int current = pair.given_indices[match.current];
    result.flow.push_back({previous.x, previous.y, previous.z, current, false});
  }
  for (const int i : found.motion.inliers)
    result.flow[i].inlier = std::find(rejected.begin(), rejected.end(), found.matches[i].current) == rejected.end();
  const std::vector<int> inliers = found.inlierFeatures(rejected);
  result.features = pair.features.count();
  result.matches = static_cast<int>(found.matches.size());
  result.inliers = static_cast<int>(inliers.size());
  result.coverage = coverage(pair.features, inliers);
  result.rms = found.motion.rms;
  result.match_time = found.match_time;
  result.motion_time = found.motion_time;
}

void reportRig(const LearntRig& rig, OdometryResult& result) {
  const RigEstimate known = rig.calibration.compensated();
  if (rig.calibration.hasWindow()) {
    const RigEstimate::Vector sigma = known.covariance.diagonal().cwiseSqrt();
    if (rig.calibration.isEstimated()) {
      result.disparity_offset = known.mean[0], result.disparity_offset_sigma = sigma[0];
      result.disparity_bend = known.mean[1], result.disparity_bend_sigma = sigma[1];
    }
    result.right_delay = known.delay(), result.right_delay_sigma = sigma[RigEstimate::kDelay];
  }
  if (const auto readout = rig.readout.estimate())
    result.readout = readout->value, result.readout_sigma = readout->sigma;
  if (const auto rotation = rig.row_pattern.rotation()) {
    Eigen::Vector3d value = rotation->value, variance = rotation->covariance.diagonal();
    // The filter knows the roll by windows, too; its variance is zero if the calibration is not estimated.
    const double of_roll = known.covariance(RigEstimate::kRoll, RigEstimate::kRoll);
    if (of_roll > 0.0) value.z() = known.mean[RigEstimate::kRoll], variance.z() = of_roll;
    result.right_rotation = rig.rotation + value;
    result.right_rotation_sigma = (rig.rotation_covariance.diagonal() + variance).cwiseSqrt();
  }
}

}  // namespace

OdometryState::OdometryState(const VisualOdometryOptions& options, int first_epoch)
    : rig(unknownRig(options)),
      shutter(options.calibration, options.tracking.rotation_acceleration),
      prior(options.tracking),
      floor(options.planar),
      epoch(first_epoch) {}

void OdometryState::forgetRig(const VisualOdometryOptions& options) {
  covariance.changeRig(rig.calibration.estimate());
  if (earlier) earlier->covariance.changeRig(rig.calibration.estimate());
  rig = unknownRig(options);
  shutter.begin(options.calibration);
  newest_rolled.reset();  // its rows were moved by the readout before
}

void OdometryState::walkRig(const RigEstimate& known, const RigEstimate::Matrix& step_covariance) {
  covariance.walkRig(known, step_covariance);
  if (earlier) earlier->covariance.walkRig(known, step_covariance);
}

void OdometryState::interrupt() {
  interrupted = true;
  prior.interrupt();
}

void OdometryState::restartAt(const ReportedPose& pose, const VisualOdometryOptions& options) {
  OdometryState fresh(options, epoch);
  fresh.T_origin_camera = pose.T_origin_camera;
  fresh.covariance.reset(pose.covariance);
  fresh.distance = pose.distance;
  fresh.last_pose_stamp = pose.stamp;
  fresh.last_sound = pose;
  fresh.map_camera = map_camera, fresh.pair_camera = pair_camera;
  fresh.last_stamp = last_stamp;
  fresh.pairs = pairs, fresh.started = started;
  fresh.interrupted = true;
  if (pose.stamp != last_stamp) fresh.outage.missGuess();  // those of pairs since the pose are forgotten, too
  *this = std::move(fresh);
}

void OdometryState::startAgain() {
  if (map) earlier = EarlierMap{std::move(*map), T_origin_camera, covariance, last_pose_stamp, epoch};
  map.reset();
  ++epoch;
  const std::int64_t last = last_pose_stamp.value_or(fallback_map->newestStamp());
  // No motion was found even where no time passed: a constant is added to what grows with time.
  const Matrix6d meanwhile = prior.outageCovariance(static_cast<double>(fallback_map->newestStamp() - last) * 1e-9);
  covariance.beginMap();
  covariance.inflate(prior.unmeasuredCovariance() + meanwhile);
  last_pose_stamp = fallback_map->newestStamp();
}

void OdometryState::returnToEarlierMap() {
  T_origin_camera = earlier->T_origin_camera;
  covariance = earlier->covariance;
  last_pose_stamp = earlier->last_pose_stamp;
  epoch = earlier->epoch;
}

void OdometryState::endOutage(bool is_earlier_map) {
  outage.end();
  fallback_map.reset();
  if (is_earlier_map) earlier.reset();
  interrupted = false;
}

void OdometryState::useFallbackMap() {
  // The guesses' error up to the fallback map is in all poses that are measured against it.
  covariance.beginMap();
  map = std::exchange(fallback_map, std::nullopt);
  started = true;
  interrupted = false;
  outage.end();
}

void OdometryState::recalibrate(const VisualOdometryOptions& options, const StereoFeatures& given) {
  forgetRig(options);
  covariance.beginMap();
  forgetMaps();
  map.emplace(options.map);
  map->insert(given, pairs, T_origin_camera.inverse(), {}, rig.calibration.calibration());
  map_camera = pair_camera = given.camera;
  camera_info_stamp = given.stamp;
}

void OdometryState::move(const Eigen::Isometry3d& T_previous_current) {
  T_origin_camera = orthonormalised(T_origin_camera * T_previous_current);
  distance += T_previous_current.translation().norm();
}

ReportedPose OdometryState::lastPose() const {
  return {T_origin_camera, covariance.value() + covariance.byRig(rig.calibration.estimate()), distance,
          last_pose_stamp};
}

OdometryResult OdometryState::report(const SearchedPair& pair, const OdometryStep& step,
                                     const std::optional<Floor>& known_floor) const {
  OdometryResult result;
  result.state = step.state;
  result.reason = step.reason;
  result.stamp = pair.features.stamp;
  result.probability = step.probability;
  result.epoch = epoch;
  result.dt = step.dt;
  result.distance = distance;
  result.keyframe_id = map && !interrupted ? map->lastKeyframeId() : 0;
  if (step.hasPose()) {
    result.has_pose = true;
    result.T_origin_camera = T_origin_camera;
    result.pose_covariance = lastPose().covariance;
    if (known_floor) result.pose_covariance = floor.covariance(*known_floor, T_origin_camera, result.pose_covariance);
  }
  if (step.T_previous_current && !step.changes_epoch) {
    result.has_motion = true;
    result.T_previous_current = *step.T_previous_current;
    result.motion_covariance = step.covariance;
    result.correction = step.correction;
  }
  reportMatches(pair, step.rejected_features, result);
  result.motion_time += step.time;
  reportRig(rig, result);
  result.used_readout = shutter.readout();
  return result;
}

}  // namespace sdvo
