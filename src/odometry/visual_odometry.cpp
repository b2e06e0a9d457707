#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../common/median.hpp"
#include "stereo_descriptor_vo/common/stopwatch.hpp"
#include "stereo_descriptor_vo/odometry/correspondences.hpp"
#include "stereo_descriptor_vo/odometry/motion_doubt.hpp"

namespace sdvo {
namespace {

constexpr int kWatched = 5;           // pairs after a motion was contested or could not be, or a pair refused
constexpr int kWatchedLong = 20;      // … after many matches agreed on none at all
constexpr int kManyMatches = 100;     // of one pair
constexpr double kFewOutliers = 0.1;  // share of the matches whose twofold says nothing
constexpr double kLately = 2.0;       // s that a motion nobody doubted tells what may be expected
constexpr double kSurprise = 0.003;   // share of what was not expected of a motion that its measurement misses

double outlierShare(const PoseEvidence& evidence) {
  return 1.0 - static_cast<double>(evidence.inliers) / std::max(evidence.matches, 1);
}

/// Median distance in the left image, px, between where correspondences were seen and where a motion puts them.
double medianMiss(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                  const std::vector<Correspondence>& correspondences) {
  std::vector<double> misses;
  misses.reserve(correspondences.size());
  for (const Correspondence& c : correspondences) {
    const Eigen::Vector3d expected = camera.project(T_current_reference * c.point);
    misses.push_back((expected - c.measurement).head<2>().norm());
  }
  return median(misses);
}

/// How many times larger the variance is than the adjustment says, where few inliers let a wrong one weigh more.
double excessOfFew(int inliers, int enough) {
  const double times = static_cast<double>(enough) / std::max(inliers, 1);
  return std::max(1.0, times * times);
}

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
      matcher_(options.matcher.widened()),
      estimator_(options.motion),
      optimizer_(options.window),
      state_(options.calibration) {}

void VisualOdometry::configure(const VisualOdometryOptions& options) {
  options_ = checked(options);
  search_ = MotionSearch(options.matcher, options.motion, options.alignment, options.tracking);
  matcher_ = FeatureMatcher(options.matcher.widened());
  estimator_ = MotionEstimator(options.motion);
  optimizer_ = WindowOptimizer(options.window);
}

void VisualOdometry::reset() {
  state_ = State(options_.calibration);
  ++epoch_;
}

void VisualOdometry::breakStream() {
  state_.map.reset();
  state_.velocity.reset();
}

void VisualOdometry::forgetTime() {
  breakStream();
  state_.last_stamp.reset();
  state_.last_velocity.reset();
}

OdometryResult VisualOdometry::update(const StereoFeatures& features, const std::optional<MotionGuess>& guess) {
  refuse(features);
  const double dt = state_.last_stamp ? static_cast<double>(features.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  const bool continued = state_.map && state_.map->continuedBy(features);
  const bool frozen = isFrozen(features, dt, guess);
  const MotionHypothesis found = continued && !frozen ? localise(features, dt, guess) : MotionHypothesis{};

  // Nothing has changed so far, and from here on nothing is refused.
  Stopwatch stopwatch;
  if (state_.camera && *state_.camera != features.camera) {
    // What was learnt of the rig is of another one.
    state_.calibration = CalibrationFilter(options_.calibration);
    state_.right_rotation = RightCameraRotation();
  }
  state_.camera = features.camera;
  state_.last_stamp = features.stamp;
  constexpr double kForgotten = 0.2;  // ratio of the interval, by each pair: it outlives bursts of three (chosen)
  if (dt <= options_.tracking.max_gap) state_.interval = std::max(dt, (1.0 - kForgotten) * state_.interval);
  ++state_.pairs;
  const bool turned = state_.right_rotation.add(features);
  state_.frozen = frozen;
  state_.contested_pairs = std::max(found.contested ? kWatched : 0, state_.contested_pairs - 1);
  if (features.report.refused) {
    // What the pairs before told of the rig may be wrong already, and those after may be refused again.
    state_.calibration = CalibrationFilter(options_.calibration);
    watch(kWatched);
  }
  // The map is of another rig than this pair.
  if (turned) watch(kWatched);
  state_.image = {features.u, features.v, features.disparity};
  Step step;
  if (frozen)
    step = predict(features, dt, "the images are those of the pair before, though the camera moved: is it frozen?");
  else if (!continued)
    step = seed(features);
  else if (found.verdict.trust != Trust::kNone)
    step = extendMap(features, dt, found);
  else
    step = predict(features, dt, found.verdict.reason);
  const bool unexplained = continued && !frozen && (step.state == TrackingState::kLost || state_.predicted_pairs > 0);
  // Many agreed on a motion that could not be: what comes next may be wrong in the same way.
  if (unexplained && found.evidence.inliers >= options_.tracking.doubtful_inliers) watch(kWatched);
  // Where many agree on none, and it is not that the camera went unseen, the views may not be of one rigid world, and
  // the next map would be as wrong.
  if (unexplained && found.evidence.matches >= kManyMatches && dt <= options_.tracking.max_gap) watch(kWatchedLong);
  if (step.T_previous_current) move(*step.T_previous_current);
  if (step.state == TrackingState::kTracking || step.state == TrackingState::kDegraded)
    state_.last_pose_stamp = features.stamp;
  step.time = stopwatch.lap();
  return report(features, dt, found, step);
}

/// The motions of the next pairs are doubted, if nothing else tells that they are right.
void VisualOdometry::watch(int pairs) {
  state_.contested_pairs = std::max(state_.contested_pairs, pairs);
}

void VisualOdometry::refuse(const StereoFeatures& features) const {
  features.check();
  if (state_.last_stamp && features.stamp <= *state_.last_stamp)
    throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                std::to_string(*state_.last_stamp) + " ns");
}

/// Looks for the pair in the map.
MotionHypothesis VisualOdometry::localise(const StereoFeatures& features, double dt,
                                          const std::optional<MotionGuess>& guess) const {
  const RigCalibration calibration = state_.calibration.calibration();
  MotionScene scene{*state_.map,   calibration,          features,
                    std::nullopt,  state_.last_velocity, state_.contested_pairs > 0,
                    velocityAge(), std::nullopt};
  // The motion since the map's newest pair: what was already covered by predicted pairs, and from there on the velocity
  // or the guess.
  const Eigen::Isometry3d T_reference_previous = state_.map->newestPose() * state_.T_origin_camera;
  if (state_.velocity && dt <= options_.tracking.max_gap)
    scene.T_current_reference = (T_reference_previous * expSE3(*state_.velocity * dt)).inverse();
  if (guess) {
    Eigen::Isometry3d T_previous_current = guess->T_previous_current;
    if (guess->rotation_only)
      T_previous_current.translation() = state_.velocity.value_or(Vector6d::Zero()).head<3>() * dt;
    scene.guess = (T_reference_previous * T_previous_current).inverse();
  }
  return search_.find(scene);
}

/// How old the last velocity was when the map's newest pair was taken, s.
double VisualOdometry::velocityAge() const {
  return static_cast<double>(state_.map->newestStamp() - state_.velocity_stamp) * 1e-9;
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
        travelCovariance(state_.last_velocity.value_or(Vector6d::Zero()), unseen, options_.tracking.max_speed));
    step.state = TrackingState::kDegraded;
    step.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state_.started = true;
  state_.last_doubt.setZero();
  state_.correction_left.setZero();
  state_.predicted_pairs = 0;
  state_.outlier_level = {};
  state_.map.emplace(options_.map);
  state_.map->insert(options_.alignment, features, state_.pairs, state_.T_origin_camera.inverse(), {},
                     state_.calibration.calibration());
  return step;
}

/// The pair joins the map, which is adjusted with it. What the adjustment refutes leaves everything as it was.
VisualOdometry::Step VisualOdometry::extendMap(const StereoFeatures& features, double dt,
                                               const MotionHypothesis& found) {
  std::optional<std::pair<LocalMap, CalibrationFilter>> before;
  if (found.verdict.trust != Trust::kSound) before.emplace(*state_.map, state_.calibration);
  Extension extension = insert(features, found);
  const PoseEvidence evidence = gatherEvidence(features, found, extension);
  PoseVerdict verdict = judgePose(options_.tracking, options_.motion.min_inliers, evidence);
  if (verdict.trust == Trust::kNone) {
    // Without a map to go back to, what it has become is of no use.
    if (before)
      state_.map = std::move(before->first), state_.calibration = std::move(before->second);
    else
      breakStream();
    return predict(features, dt, verdict.reason + " after the adjustment");
  }
  if (verdict.trust == Trust::kSound || found.T_current_reference_else) verdict = found.verdict;
  const bool watched = isWatched(evidence) && verdict.trust == Trust::kSound;
  if (watched)
    verdict = {Trust::kDoubtful,
               "a moment ago left and right disagreed, two motions were in view, or none was certain"};

  Step step;
  step.state = TrackingState::kTracking;
  step.rejected_rows = extension.adjustment.rejected_rows;
  step.T_previous_current = (state_.map->newestPose() * state_.T_origin_camera).inverse();
  measure(dt, found, evidence, verdict.trust, extension, step);
  const Matrix6d measured = step.covariance;
  if (verdict.trust == Trust::kSound) state_.last_doubt.setZero();
  if (verdict.trust == Trust::kDoubtful) {
    if (!watched || state_.last_doubt.isZero())
      state_.last_doubt = doubt(found, extension, *step.T_previous_current, dt);
    step.state = TrackingState::kDegraded;
    step.reason = "doubtful: " + verdict.reason;
    step.covariance += state_.last_doubt;
    // Where the lasting points confirm the way, the stamps may be wrong, and only the speed is in doubt.
    if (!verdict.of_rate || !lastingAgree(options_.tracking, evidence)) state_.covariance.doubt(state_.last_doubt);
  }
  if (options_.planar.planar) noteFloor(step);
  noteVelocity(features.stamp, found, evidence, verdict.trust, measured);
  state_.predicted_pairs = 0;
  if (state_.map->newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

VisualOdometry::Extension VisualOdometry::insert(const StereoFeatures& features, const MotionHypothesis& found) {
  LocalMap& map = *state_.map;
  Extension extension;
  extension.T_previous_origin = map.newestPose();
  extension.calibration = state_.calibration.calibration();
  map.insert(options_.alignment, features, state_.pairs, found.motion.T_current_reference * map.newestPose(),
             found.sightings, extension.calibration);
  extension.T_keyframe_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && found.verdict.trust == Trust::kSound) recall(features);
  const CalibrationBelief prior = state_.calibration.prior(map.oldestId());
  const std::optional<Floor> floor = this->floor();
  extension.adjustment = map.adjust(optimizer_, prior, extension.calibration, floor);
  // The window's first pose does not move in the adjustment: what it carries in height and tilt goes with the whole map.
  if (floor) map.moveTo(floor->settled(map.newestPose(), state_.covariance.value()));
  map.renewLooks(features, found.sightings);
  return extension;
}

/// What speaks for the motion after the adjustment. Few inliers make that know less.
PoseEvidence VisualOdometry::gatherEvidence(const StereoFeatures& features, const MotionHypothesis& found,
                                            Extension& extension) const {
  const LocalMap& map = *state_.map;
  LocalMap::Adjustment& adjustment = extension.adjustment;
  PoseEvidence evidence = found.evidence;
  const std::vector<int> confirmed = found.inlierRows(adjustment.rejected_rows);
  evidence.inliers = static_cast<int>(confirmed.size());
  evidence.coverage = coverage(features, confirmed);
  evidence.lasting_inliers = found.lastingInliers(adjustment.rejected_rows);
  // What the adjustment did to the map as a whole is no motion.
  const Eigen::Isometry3d T_before_after = extension.T_keyframe_origin.inverse() * map.poseBeforeNewest();
  evidence.motion = extension.T_previous_origin * T_before_after * map.newestPose().inverse();
  if (adjustment.success) {
    adjustment.covariances.inflateNewest(excessOfFew(evidence.inliers, options_.tracking.doubtful_inliers));
    evidence.deviation = std::sqrt(adjustment.covariances.since_keyframe.topLeftCorner<3, 3>().trace());
  }
  return evidence;
}

/// Whether a motion is doubted because of what was seen a moment ago, or of what this pair shows.
bool VisualOdometry::isWatched(const PoseEvidence& evidence) {
  if (lastingDisagree(options_.tracking, evidence)) watch(kWatched);
  // After a new start, or a motion of something else, it may be that which is followed.
  if ((!state_.velocity || state_.contested_pairs > 0) && isUnexpected(evidence)) watch(kWatched);
  return state_.contested_pairs > 0;
}

/// The motion's covariance, and what the adjustment tells of the rig and of the poses before.
void VisualOdometry::measure(double dt, const MotionHypothesis& found, const PoseEvidence& evidence, Trust trust,
                             Extension& extension, Step& step) {
  const LocalMap& map = *state_.map;
  LocalMap::Adjustment& adjustment = extension.adjustment;
  if (!adjustment.success) {
    step.covariance = found.motion.covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
    return;
  }
  state_.calibration.note(map.newestId(), extension.calibration, adjustment.calibration_information);
  if (trust == Trust::kSound && adjustment.common_disparity_square)
    state_.calibration.noteCommon(*adjustment.common_disparity_square);
  adjustment.covariances.inflateNewest(state_.outlier_level.excess(kFewOutliers + outlierShare(evidence)));
  step.covariance = state_.covariance.advance(*step.T_previous_current, adjustment.covariances);
  // As a perturbation of the frame before, then of the newest one.
  step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                    logSE3(extension.T_keyframe_origin * map.poseBeforeNewest().inverse());
  cover(step);
  // A view that changed in another way than expected was aligned from a worse start.
  const Eigen::Isometry3d expected = expSE3(state_.velocity.value_or(Vector6d::Zero()) * dt);
  step.covariance += kSurprise * kSurprise * disagreement(*step.T_previous_current, expected);
}

/// The velocity since the map's newest pair before, for what comes next. Stamps that lie too close make none, nor does
/// what may be the motion of something else.
void VisualOdometry::noteVelocity(std::int64_t stamp, const MotionHypothesis& found, const PoseEvidence& evidence,
                                  Trust trust, const Matrix6d& covariance) {
  const Vector6d velocity = logSE3(found.motion.T_current_reference.inverse()) / evidence.dt;
  if (isImplausible(options_.tracking, evidence) || !(velocity.head<3>().norm() <= options_.tracking.max_speed) ||
      !(velocity.tail<3>().norm() <= options_.tracking.max_rotation_rate))
    return;
  state_.velocity = velocity;
  state_.velocity_covariance = covariance / (evidence.dt * evidence.dt);
  // What is doubted predicts the next pair, but nothing is judged by it as long as there is something better.
  const double age = static_cast<double>(stamp - state_.velocity_stamp) * 1e-9;
  if (trust != Trust::kSound && state_.last_velocity && age <= kLately) return;
  state_.last_velocity = velocity;
  state_.velocity_stamp = stamp;
}

/// A camera that comes back to where it was before is tied to the key frame that it left there.
void VisualOdometry::recall(const StereoFeatures& features) {
  LocalMap& map = *state_.map;
  const OldKeyframe* old = map.revisited();
  if (!old) return;
  const Eigen::Isometry3d expected = map.newestPose() * old->T_camera_origin.inverse();
  const auto matches = matcher_.match(old->rows, features, expected);
  const RigCalibration calibration = state_.calibration.calibration();
  const auto correspondences = correspond(old->rows, features, matches, calibration);
  MotionEstimate motion = estimator_.estimate(features.camera, correspondences, expected);
  if (!motion.success) return;

  std::vector<LocalMap::Tie> ties;
  std::vector<Correspondence> aligned;
  for (const int i : motion.inliers) {
    const FeatureMatch& match = matches[i];
    const OldKeyframe::Point& point = old->points[match.reference];
    const auto found = old->reference(match.reference)
                           .findIn(options_.alignment, features, match.current,
                                   motion.T_current_reference * old->T_camera_origin, point.position);
    if (!found) continue;
    const Eigen::Vector3d& then = old->rows.positions[match.reference];
    const Eigen::Vector3d measurement = measurementOf(features, match.current, calibration, found->shift);
    const double scale = then.z() / (motion.T_current_reference * then).z();
    ties.push_back({match.reference, match.current, measurement.head<2>(), found->sigma, scale});
    aligned.push_back({then, measurement});
  }
  if (static_cast<int>(ties.size()) < options_.map.lasting_points) return;
  refineMotion(features.camera, options_.motion, aligned, motion.T_current_reference);
  // A rig whose rectification is not exact sees a place differently once it is elsewhere in the image.
  constexpr double kSameWorld = 0.3;  // px; up to 0.25 where rectification is exact
  if (medianMiss(features.camera, motion.T_current_reference, aligned) > kSameWorld) return;

  // What the map lost since then, it lost as a whole: the adjustment would take so large an offset for outliers.
  constexpr double kSignificant = 16.8;  // chi-square of six, 99 %
  const Eigen::Isometry3d T_camera_origin = motion.T_current_reference * old->T_camera_origin;
  const Vector6d offset = logSE3(T_camera_origin * map.newestPose().inverse());
  if (offset.dot(motion.covariance.ldlt().solve(offset)) > kSignificant) map.moveTo(T_camera_origin);
  map.recall(*old, ties);
}

/// A motion between two reported poses contains what the map has learnt of the first one meanwhile. Where its
/// square is more than half of what the covariances of the motion and of the pose expect on average, they are widened
/// by it, and beyond chance the reason says so. The adjustment takes one step a pair: part of so large a correction is
/// left for the next ones.
void VisualOdometry::cover(Step& step) {
  constexpr double kLeft = 0.25;
  step.covariance += state_.correction_left * state_.correction_left.transpose();
  state_.correction_left *= kLeft;
  state_.covariance.cover(step.correction);
  if (!widen(step.covariance, step.correction)) return;
  state_.correction_left = kLeft * step.correction;
  std::ostringstream reason;
  reason << "the map corrected the pose by " << step.correction.head<3>().norm() << " m and "
         << step.correction.tail<3>().norm() << " rad";
  step.reason = reason.str();
}

/// How far a doubtful motion may be off: as far as what was expected, and as the hypothesis that speaks against it; and
/// as far as the adjustment moved it.
Matrix6d VisualOdometry::doubt(const MotionHypothesis& found, const Extension& extension,
                               const Eigen::Isometry3d& T_previous_current, double dt) const {
  const Eigen::Isometry3d T_previous_measured =
      (found.motion.T_current_reference * extension.T_previous_origin * state_.T_origin_camera).inverse();
  const Eigen::Isometry3d predicted = expSE3(state_.last_velocity.value_or(Vector6d::Zero()) * dt);
  Matrix6d doubt = disagreement(T_previous_current, T_previous_measured) + disagreement(T_previous_current, predicted) +
                   predictionCovariance(dt);
  if (found.T_current_reference_else) {
    // Both hypotheses start from the same pair of the map.
    const Eigen::Isometry3d T_else_found = found.motion.T_current_reference * found.T_current_reference_else->inverse();
    doubt += disagreement(Eigen::Isometry3d::Identity(), T_else_found);
  }
  return doubt;
}

VisualOdometry::Step VisualOdometry::predict(const StereoFeatures& features, double dt, const std::string& failure) {
  Step step;
  step.reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state_.velocity && dt <= options_.tracking.max_gap &&
                           state_.predicted_pairs < options_.tracking.max_predicted_pairs;
  if (!can_predict) {
    breakStream();
    step.state = TrackingState::kLost;
    return step;
  }
  ++state_.predicted_pairs;
  step.state = TrackingState::kDegraded;
  step.reason = "motion predicted: " + step.reason;
  step.T_previous_current = expSE3(*state_.velocity * dt);
  // Stamps of a burst are closer together than the moments at which its pairs were taken.
  const double time = std::max(dt, state_.interval);
  const Vector6d missed = *state_.velocity * (time - dt);
  // A motion that is known badly, or doubtful, predicts badly, too.
  step.covariance = predictionCovariance(time) + missed * missed.transpose() +
                    time * time * state_.velocity_covariance + state_.last_doubt;
  state_.covariance.advance(*step.T_previous_current, step.covariance);
  return step;
}

std::optional<Floor> VisualOdometry::floor() const {
  if (!options_.planar.planar) return std::nullopt;
  return Floor(options_.planar, T_base_camera_, state_.floor_height);
}

/// Whether the newest pose is on the floor: a ramp is told of, and a level stretch behind it is another floor.
void VisualOdometry::noteFloor(Step& step) {
  constexpr int kLevel = 10;    // pairs that make another floor
  const Floor known = *floor();
  const Eigen::Isometry3d& T_camera_origin = state_.map->newestPose();
  const Eigen::Vector3d residual = known.residual(T_camera_origin);
  const double height = known.base(T_camera_origin).translation().z();
  const bool is_tilted = !Floor::isLevel(residual);
  state_.on_floor = Floor::isOn(residual);
  state_.level_pairs = state_.on_floor || is_tilted ? 0 : state_.level_pairs + 1;
  std::ostringstream reason;
  if (is_tilted)
    reason << "off the floor: tilted by " << (residual.tail<2>().norm() * options_.planar.planar_tilt_sigma)
           << " degrees, a ramp?";
  else if (!state_.on_floor)
    reason << "off the floor: " << height - state_.floor_height << " m above it";
  if (state_.level_pairs >= kLevel) {
    reason << ", level: this is the floor from now on";
    state_.floor_height = height;
    state_.level_pairs = 0;
  }
  if (step.reason.empty()) step.reason = reason.str();
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
    if (options_.planar.planar && state_.on_floor)
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

/// A camera that repeats its images seems to stand. Whether it does, the guess or the motion before tells: where that
/// would have moved the points, only the images stood still.
bool VisualOdometry::isFrozen(const StereoFeatures& features, double dt,
                              const std::optional<MotionGuess>& guess) const {
  constexpr double kSeen = 1.0;  // px
  if (features.count() == 0 || state_.image[0] != features.u || state_.image[1] != features.v ||
      state_.image[2] != features.disparity)
    return false;
  const bool is_guessed = guess && !guess->rotation_only;
  if (!is_guessed && state_.frozen) return true;
  if (!is_guessed && !state_.velocity) return false;
  const Eigen::Isometry3d T_current_previous =
      is_guessed ? guess->T_previous_current.inverse() : expSE3(*state_.velocity * -dt);
  int moved = 0;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector3d point = features.camera.backProject(features.u[i], features.v[i], features.disparity[i]);
    const Eigen::Vector3d now = features.camera.project(T_current_previous * point);
    moved += std::hypot(now.x() - features.u[i], now.y() - features.v[i]) > kSeen;
  }
  return 2 * moved > features.count();
}

}  // namespace sdvo
