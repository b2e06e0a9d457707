#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "stereo_descriptor_vo/common/stopwatch.hpp"

namespace sdvo {
namespace {

constexpr int kManyMatches = 100;  // of one pair: agreement on no motion is then no lack of points (chosen)

/// The pose of an optical frame (z ahead, x right) at the origin of a base (x ahead, z up).
Eigen::Isometry3d lookingAhead() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return T_base_camera;
}

}  // namespace

const char* toString(TrackingState state) {
  switch (state) {
    case TrackingState::kWaiting:
      return "WAITING";
    case TrackingState::kTracking:
      return "TRACKING";
    case TrackingState::kDegraded:
      return "DEGRADED";
    case TrackingState::kLost:
      return "LOST";
  }
  return "UNKNOWN";
}

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options)
    : options_(checked(options)),
      T_base_camera_(lookingAhead()),
      search_(options.matcher, options.motion, options.alignment, options.tracking),
      revisit_(options.matcher, options.motion, options.alignment),
      optimizer_(options.window),
      state_(options.calibration) {}

void VisualOdometry::configure(const VisualOdometryOptions& options) {
  options_ = checked(options);
  search_ = MotionSearch(options.matcher, options.motion, options.alignment, options.tracking);
  revisit_ = Revisit(options.matcher, options.motion, options.alignment);
  optimizer_ = WindowOptimizer(options.window);
}

void VisualOdometry::reset() {
  state_ = State(options_.calibration);
  ++epoch_;
}

void VisualOdometry::breakStream() {
  state_.map.reset();
  state_.belief.interrupt();
}

void VisualOdometry::forgetTime() {
  breakStream();
  state_.last_stamp.reset();
  state_.belief.forget();
}

OdometryResult VisualOdometry::update(const StereoFeatures& features, const std::optional<MotionGuess>& guess) {
  refuse(features);
  const double dt = state_.last_stamp ? static_cast<double>(features.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  const bool continued = state_.map && state_.map->continuedBy(features);
  const bool frozen = isFrozen(features, dt, guess);
  const MotionHypothesis found = continued && !frozen ? propose(features, dt, guess) : MotionHypothesis{};

  // Nothing has changed so far, and from here on nothing is refused.
  Stopwatch stopwatch;
  begin(features, dt);
  Step step;
  if (frozen)
    step = predict(features, dt,
                   "the images repeat those of the previous pair although the camera moved: is the driver frozen?");
  else if (!continued)
    step = seed(features);
  else if (found.verdict.trust == Trust::kNone)
    step = predict(features, dt, found.verdict.reason);
  else
    step = extendMap(features, dt, found);
  if (continued && !frozen) suspect(dt, found, step);
  state_.suspicion.pass();
  state_.images.remember(features, frozen);
  if (step.T_previous_current) move(*step.T_previous_current);
  if (step.state == TrackingState::kTracking || step.state == TrackingState::kDegraded)
    state_.last_pose_stamp = features.stamp;
  step.time = stopwatch.lap();
  return report(features, dt, found, step);
}

void VisualOdometry::refuse(const StereoFeatures& features) const {
  features.check();
  if (state_.last_stamp && features.stamp <= *state_.last_stamp)
    throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                std::to_string(*state_.last_stamp) + " ns");
}

/// A camera that repeats its images seems to stand. The guess, or the motion before, shows whether it does.
bool VisualOdometry::isFrozen(const StereoFeatures& features, double dt,
                              const std::optional<MotionGuess>& guess) const {
  if (guess && !guess->rotation_only) return state_.images.areFrozen(features, guess->T_previous_current, true);
  std::optional<Eigen::Isometry3d> predicted;
  if (state_.belief.velocity()) predicted = state_.belief.predicted(dt);
  return state_.images.areFrozen(features, predicted, false);
}

/// Looks for the pair in the map.
MotionHypothesis VisualOdometry::propose(const StereoFeatures& features, double dt,
                                         const std::optional<MotionGuess>& guess) const {
  const MotionBelief& belief = state_.belief;
  const RigCalibration calibration = state_.calibration.calibration();
  MotionScene scene{*state_.map,
                    calibration,
                    features,
                    std::nullopt,
                    belief.trusted(),
                    state_.suspicion.isRaised(),
                    belief.trustedAge(state_.map->newestStamp()),
                    std::nullopt};
  // The motion since the map's newest pair: what was already covered by predicted pairs, and from there on the velocity
  // or the guess.
  const Eigen::Isometry3d T_reference_previous = state_.map->newestPose() * state_.T_origin_camera;
  if (belief.velocity() && dt <= options_.tracking.max_gap)
    scene.T_current_reference = (T_reference_previous * belief.predicted(dt)).inverse();
  if (guess) {
    Eigen::Isometry3d T_previous_current = guess->T_previous_current;
    if (guess->rotation_only)
      T_previous_current.translation() = belief.velocity().value_or(Vector6d::Zero()).head<3>() * dt;
    scene.guess = (T_reference_previous * T_previous_current).inverse();
  }
  return search_.find(scene);
}

/// Takes note of the pair, whatever becomes of its motion.
void VisualOdometry::begin(const StereoFeatures& features, double dt) {
  if (state_.camera && *state_.camera != features.camera) {
    // What was learnt of the rig is of another one.
    state_.calibration = CalibrationFilter(options_.calibration);
    state_.right_rotation = RightCameraRotation();
  }
  state_.camera = features.camera;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  if (dt <= options_.tracking.max_gap) state_.belief.pass(dt);
  // The map is of another rig than this pair.
  if (state_.right_rotation.add(features)) state_.suspicion.raise("the right camera seems to have turned");
  if (features.report.refused) {
    // What the pairs before told of the rig may be wrong already, and those after may be refused again.
    state_.calibration = CalibrationFilter(options_.calibration);
    state_.suspicion.raise("left and right did not belong together");
  }
}

/// What this pair showed may mislead the next ones, too.
void VisualOdometry::suspect(double dt, const MotionHypothesis& found, const Step& step) {
  const PoseEvidence& evidence = found.evidence;
  const bool agree = evidence.inliers >= options_.tracking.doubtful_ratio * evidence.matches;
  if (step.state != TrackingState::kLost && state_.predicted_pairs == 0) return;
  // Unless the camera went unseen, the views may not be of one rigid world, and the next map would be as wrong.
  if (evidence.matches >= kManyMatches && !agree && dt <= options_.tracking.max_gap)
    state_.suspicion.raise("many matches agreed on no motion", Suspicion::kLong);
}

VisualOdometry::Step VisualOdometry::seed(const StereoFeatures& features) {
  Step step;
  breakStream();
  if (features.count() < options_.motion.min_inliers) {
    step.state = state_.started ? TrackingState::kLost : TrackingState::kWaiting;
    step.reason = "only " + std::to_string(features.count()) + " features" +
                  (features.report.status.empty() ? "" : ": " + features.report.status);
    return step;
  }
  if (state_.started) {
    ++epoch_;
    const double unseen = std::max(0.0, static_cast<double>(features.stamp - state_.last_pose_stamp) * 1e-9);
    state_.covariance.restart(
        travelCovariance(state_.belief.trusted().value_or(Vector6d::Zero()), unseen, options_.tracking.max_speed));
    step.state = TrackingState::kDegraded;
    step.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state_.started = true;
  state_.belief.doubt(Matrix6d::Zero());
  state_.predicted_pairs = 0;
  state_.map.emplace(options_.map);
  state_.map->insert(options_.alignment, features, state_.pairs, state_.T_origin_camera.inverse(), {},
                     state_.calibration.calibration());
  return step;
}

/// The pair joins the map unless the adjustment refutes its motion.
VisualOdometry::Step VisualOdometry::extendMap(const StereoFeatures& features, double dt,
                                               const MotionHypothesis& found) {
  if (found.contested) state_.suspicion.raise("something else moved in view");
  const Candidate candidate = adjust(features, found);
  if (candidate.verdict.trust == Trust::kNone)
    return predict(features, dt, candidate.verdict.reason + " after the adjustment");
  const Eigen::Isometry3d T_previous_measured =
      (found.motion.T_current_reference * state_.map->newestPose() * state_.T_origin_camera).inverse();
  commit(candidate);

  Step step = measure(found, candidate);
  PoseVerdict verdict = candidate.verdict;
  // After a new start, or a motion of something else, it may be that which is followed.
  const PoseEvidence& evidence = candidate.evidence;
  if ((!state_.belief.velocity() || state_.suspicion.isRaised()) && isUnexpected(evidence))
    state_.suspicion.raise("the motion changed faster than a vehicle's can");
  if (lastingDisagree(options_.tracking, evidence)) state_.suspicion.raise("points that stood still so far moved");
  if (verdict.trust == Trust::kSound && state_.suspicion.isRaised())
    verdict = {Trust::kDoubtful, "a moment ago " + state_.suspicion.cause()};
  const Matrix6d measured = step.covariance;
  Matrix6d doubt = Matrix6d::Zero();
  if (verdict.trust == Trust::kDoubtful) {
    doubt = this->doubt(found, T_previous_measured, *step.T_previous_current, dt);
    step.state = TrackingState::kDegraded;
    step.reason = "doubtful: " + verdict.reason;
    step.covariance += doubt;
    // Where the lasting points confirm the motion, the stamps may be wrong, and only the speed is in doubt.
    if (!verdict.of_rate || !lastingAgree(options_.tracking, evidence)) state_.covariance.doubt(doubt);
  }
  state_.belief.doubt(doubt);
  noteVelocity(features.stamp, found, evidence, verdict.trust == Trust::kSound, measured);
  if (options_.planar.planar) {
    const std::string off = state_.floor.note(*floor(), state_.map->newestPose());
    if (step.reason.empty()) step.reason = off;
  }
  state_.predicted_pairs = 0;
  if (state_.map->newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// Adjusts a copy of the map with the pair in it, and judges the motion that this leaves.
VisualOdometry::Candidate VisualOdometry::adjust(const StereoFeatures& features, const MotionHypothesis& found) {
  const Eigen::Isometry3d T_previous_origin = state_.map->newestPose();
  state_.candidate = state_.map;
  LocalMap& map = *state_.candidate;
  Candidate candidate;
  candidate.calibration = state_.calibration.calibration();
  map.insert(options_.alignment, features, state_.pairs, found.motion.T_current_reference * T_previous_origin,
             found.sightings, candidate.calibration);
  candidate.T_keyframe_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && found.verdict.trust == Trust::kSound)
    revisit_.recall(features, candidate.calibration, map);
  const std::optional<Floor> floor = this->floor();
  candidate.adjustment = map.adjust(optimizer_, state_.calibration.prior(map.oldestId()), candidate.calibration, floor);
  // The window's first pose does not move in the adjustment: what it carries in height and tilt goes with the whole
  // map.
  if (floor) map.moveTo(floor->settled(map.newestPose(), state_.covariance.value()));
  map.renewLooks(features, found.sightings);

  const LocalMap::Adjustment& adjustment = candidate.adjustment;
  PoseEvidence& evidence = candidate.evidence = found.evidence;
  evidence.inliers = static_cast<int>(found.inlierRows(adjustment.rejected_rows).size());
  evidence.lasting_inliers = found.lastingInliers(adjustment.rejected_rows);
  // What the adjustment did to the map as a whole is no motion.
  const Eigen::Isometry3d T_before_after = candidate.T_keyframe_origin.inverse() * map.poseBeforeNewest();
  evidence.motion = T_previous_origin * T_before_after * map.newestPose().inverse();
  evidence.distance = (map.poseBeforeNewest() * map.newestPose().inverse()).translation().norm();
  if (adjustment.success) evidence.deviation = std::sqrt(adjustment.since_keyframe.topLeftCorner<3, 3>().trace());
  candidate.verdict = judge(found, evidence);
  return candidate;
}

/// The adjustment can refute a motion or cast doubt on it, but takes back no doubt of the search.
PoseVerdict VisualOdometry::judge(const MotionHypothesis& found, const PoseEvidence& evidence) const {
  PoseVerdict verdict = judgePose(options_.tracking, options_.motion.min_inliers, evidence);
  return verdict.trust == Trust::kSound || (verdict.trust == Trust::kDoubtful && found.rival) ? found.verdict : verdict;
}

void VisualOdometry::commit(const Candidate& candidate) {
  std::swap(state_.map, state_.candidate);
  const LocalMap::Adjustment& adjustment = candidate.adjustment;
  if (!adjustment.success) return;
  state_.calibration.note(state_.map->oldestId(), state_.map->newestId(), candidate.calibration,
                          adjustment.calibration_information);
  const bool is_sound = candidate.verdict.trust == Trust::kSound && !state_.suspicion.isRaised();
  if (is_sound && adjustment.common_disparity_square)
    state_.calibration.noteCommon(*adjustment.common_disparity_square);
}

/// The motion between the two poses, and its covariance.
VisualOdometry::Step VisualOdometry::measure(const MotionHypothesis& found, const Candidate& candidate) {
  const LocalMap& map = *state_.map;
  Step step;
  step.state = TrackingState::kTracking;
  step.rejected_rows = candidate.adjustment.rejected_rows;
  step.T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  if (!candidate.adjustment.success) {
    step.covariance = found.motion.covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
    return step;
  }
  step.covariance = state_.covariance.measure(*step.T_previous_current, candidate.adjustment.since_keyframe);
  // The motion between two reported poses contains what the map has learnt of the first one meanwhile: a perturbation
  // of the key frame before, then of the newest pair.
  step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                    logSE3(candidate.T_keyframe_origin * map.poseBeforeNewest().inverse());
  state_.covariance.cover(step.correction);
  if (!widen(step.covariance, step.correction)) return step;
  std::ostringstream reason;
  reason << "the map corrected the pose by " << step.correction.head<3>().norm() << " m and "
         << step.correction.tail<3>().norm() << " rad";
  step.reason = reason.str();
  return step;
}

/// Covariance of a doubtful motion: as far off as what was expected, as the rival, and as the adjustment moved it.
Matrix6d VisualOdometry::doubt(const MotionHypothesis& found, const Eigen::Isometry3d& T_previous_measured,
                               const Eigen::Isometry3d& T_previous_current, double dt) const {
  Matrix6d doubt = disagreement(T_previous_current, T_previous_measured) +
                   disagreement(T_previous_current, state_.belief.expected(dt)) + predictionCovariance(dt);
  // Both hypotheses start from the same pair of the map.
  if (found.rival)
    doubt += disagreement(Eigen::Isometry3d::Identity(), found.motion.T_current_reference * found.rival->inverse());
  return doubt;
}

/// The velocity since the map's newest pair before. Stamps that lie too close make none, nor does what may be the
/// motion of something else.
void VisualOdometry::noteVelocity(std::int64_t stamp, const MotionHypothesis& found, const PoseEvidence& evidence,
                                  bool is_trusted, const Matrix6d& covariance) {
  const Vector6d velocity = logSE3(found.motion.T_current_reference.inverse()) / evidence.dt;
  if (isImplausible(options_.tracking, evidence) || !(velocity.head<3>().norm() <= options_.tracking.max_speed) ||
      !(velocity.tail<3>().norm() <= options_.tracking.max_rotation_rate))
    return;
  state_.belief.measure(stamp, velocity, evidence.dt, covariance, is_trusted);
}

VisualOdometry::Step VisualOdometry::predict(const StereoFeatures& features, double dt, const std::string& failure) {
  Step step;
  step.reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state_.belief.velocity() && dt <= options_.tracking.max_gap &&
                           state_.predicted_pairs < options_.tracking.max_predicted_pairs;
  if (!can_predict) {
    breakStream();
    step.state = TrackingState::kLost;
    return step;
  }
  ++state_.predicted_pairs;
  step.state = TrackingState::kDegraded;
  step.reason = "motion predicted: " + step.reason;
  step.T_previous_current = state_.belief.predicted(dt);
  step.covariance = state_.belief.predictedCovariance(dt);
  state_.covariance.advance(*step.T_previous_current, step.covariance);
  return step;
}

std::optional<Floor> VisualOdometry::floor() const {
  if (!options_.planar.planar) return std::nullopt;
  return Floor(options_.planar, T_base_camera_, state_.floor.height());
}

std::vector<Eigen::Vector3d> VisualOdometry::mapPoints() const {
  return state_.map ? state_.map->positions() : std::vector<Eigen::Vector3d>();
}

void VisualOdometry::move(const Eigen::Isometry3d& T_previous_current) {
  state_.T_origin_camera = orthonormalised(state_.T_origin_camera * T_previous_current);
  state_.distance += T_previous_current.translation().norm();
}

OdometryResult VisualOdometry::report(const StereoFeatures& features, double dt, const MotionHypothesis& found,
                                      const Step& step) const {
  OdometryResult result;
  result.state = step.state;
  result.reason = step.reason;
  result.stamp = features.stamp;
  result.epoch = epoch_;
  result.dt = dt;
  result.distance = state_.distance;
  result.keyframe_id = state_.map ? state_.map->lastKeyframeId() : 0;
  if (step.state == TrackingState::kTracking || step.state == TrackingState::kDegraded) {
    result.has_pose = true;
    result.T_origin_camera = state_.T_origin_camera;
    result.pose_covariance = state_.covariance.value();
    if (options_.planar.planar && state_.floor.isOnFloor())
      result.pose_covariance = floor()->constrained(state_.T_origin_camera, result.pose_covariance);
  }
  if (step.T_previous_current) {
    result.has_motion = true;
    result.T_previous_current = *step.T_previous_current;
    result.motion_covariance = step.covariance;
    result.correction = step.correction;
  }

  result.flow.reserve(found.matches.size());
  for (const FeatureMatch& match : found.matches) {
    const cv::Point3f& previous = found.view->pixels[match.reference];
    result.flow.push_back({previous.x, previous.y, match.current, false});
  }
  const std::vector<int>& rejected = step.rejected_rows;
  for (const int i : found.motion.inliers) {
    FeatureFlow& flow = result.flow[i];
    flow.inlier = std::find(rejected.begin(), rejected.end(), flow.current) == rejected.end();
  }
  const std::vector<int> inliers = found.inlierRows(rejected);
  result.features = features.count();
  result.matches = static_cast<int>(found.matches.size());
  result.inliers = static_cast<int>(inliers.size());
  result.coverage = coverage(features, inliers);
  result.rms = found.motion.rms;
  result.match_time = found.match_time;
  result.motion_time = found.motion_time + step.time;

  const RigCalibration::Vector sigma = state_.calibration.sigma();
  if (sigma.allFinite()) {
    result.disparity_offset = state_.calibration.calibration().value[0];
    result.disparity_bend = state_.calibration.calibration().value[1];
    result.disparity_offset_sigma = sigma[0];
    result.disparity_bend_sigma = sigma[1];
  }
  result.right_rotation = state_.right_rotation.rotation();
  result.right_rotation_sigma = state_.right_rotation.sigma();
  return result;
}

}  // namespace sdvo
