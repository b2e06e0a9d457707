#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../belief/belief.hpp"
#include "../common/stopwatch.hpp"
#include "../map/reacquisition.hpp"
#include "odometry_state.hpp"
#include "pair_search.hpp"

namespace sdvo {
namespace {

constexpr int kManyMatches = 100;  // of a pair (chosen): if no motion fits so many, points are not lacking

/// Second moment of an innovation that chance does not explain: stamps may be wrong, or the camera did what none does.
Matrix6d unexpected(const MotionScene& scene, const MotionHypothesis& found) {
  if (!(found.innovation > noiseGate(6))) return Matrix6d::Zero();
  const Vector6d innovation = scene.prior.front().innovation(found.motion.T_current_reference.inverse());
  return innovation * innovation.transpose();
}

/// Adjustment of windows under the odometry's noise.
WindowOptimizerOptions windowWith(const NoiseOptions& noise) {
  WindowOptimizerOptions window;
  window.noise = noise;
  return window;
}

/// The pose of an optical frame (z ahead, x right) at the origin of a base (x ahead, z up).
Eigen::Isometry3d lookingAhead() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return T_base_camera;
}

/// Rows of the motion's inliers over the last `dt` s, with the motion's velocities, because corners have more noise.
/// `delay`: known delay of the right image, s.
std::vector<RowMotion> rowMotions(const StereoFeatures& features, const MotionHypothesis& found, double dt,
                                  const RowPattern& pattern, double delay) {
  // Mean rows of other pairs' right images contain the delay itself: subtracting them would hide it.
  const bool has_pattern = !pattern.isOfOtherPairs(dt);
  std::vector<RowMotion> rows;
  rows.reserve(found.motion.inliers.size());
  for (const int i : found.motion.inliers) {
    const auto [reference, current, distance] = found.matches[static_cast<std::size_t>(i)];
    const Eigen::Vector3d now = found.motion.T_current_reference * found.view->points.positions[reference];
    const StereoCamera& camera = features.camera;
    const double velocity = (camera.project(now).y() - found.view->pixels[reference].y) / dt;
    const double dv = has_pattern ? pattern.change(features, current) : features.dv[current];
    rows.push_back({velocity, dv - delay * velocity,
                    RowDelay::partOf(features.u[current], features.v[current], camera.width, camera.height)});
  }
  return rows;
}

}  // namespace

/// The steps of a pair, in the order of update(), and what they remember.
class VisualOdometry::Impl {
 public:
  explicit Impl(const VisualOdometryOptions& options);

  OdometryResult update(const StereoFeatures& given, const std::optional<MotionGuess>& guess);
  void reset() { state_ = OdometryState(options_, state_.epoch + 1); }
  void breakStream() { state_.interrupt(); }
  void takePose(const Matrix6d& covariance);
  const Eigen::Isometry3d& lastPose() const { return state_.T_origin_camera; }
  void configure(const VisualOdometryOptions& options);
  const VisualOdometryOptions& options() const { return options_; }
  void mountAt(const Eigen::Isometry3d& T_base_camera);
  std::vector<Eigen::Vector3d> mapPoints() const;

 private:
  using Step = OdometryStep;

  /// The map with the pair, adjusted. The state does not change until commit().
  struct Candidate {
    RigCalibration calibration;
    RigEstimate::Shape calibration_by_rig;
    double delay = 0.0;  ///< of the right camera, compensated, s
    LocalMap::Adjustment adjustment;
    Eigen::Isometry3d motion;             ///< T_reference_current after the adjustment
    Eigen::Isometry3d T_keyframe_origin;  ///< of the last key frame, before the adjustment
    double distance = 0.0;                ///< from that key frame, m
  };

  /// Decision about a pair: the reason why it cannot join the map, else the map with it.
  struct Outcome {
    std::string refusal;
    std::optional<Candidate> candidate;
    double since = 0.0;           ///< the map's newest pair, s
    bool in_fallback = false;     ///< it is measured against the fallback map, ...
    bool starts_again = false;    ///< ... whose pose is not that of the guesses
    bool in_earlier_map = false;  ///< it is found in the map from before a restart
  };

  void refuse(const StereoFeatures& features) const;
  OdometryResult checkedResult(OdometryResult result);
  std::optional<Floor> floor() const;

  void begin(const PairSearch& pair, const std::optional<MotionGuess>& guess);
  std::optional<MeasuredPair> measuredPair(const PairSearch& pair) const;
  std::vector<Evidence> evidenceAgainst(const PairSearch& pair, const std::optional<MeasuredPair>& measured) const;
  Step unmeasured(const PairSearch& pair, const std::string& why, const std::vector<Evidence>& evidence);
  Outcome judged(PairSearch& pair);
  Candidate adjustBeyondDoubt(PairSearch& pair);
  Candidate adjust(const PairSearch& pair, bool may_recall);
  Step apply(const Outcome& outcome, const PairSearch& pair, const std::vector<Evidence>& evidence);
  void commit(const Candidate& candidate, const Belief& belief);
  Step measure(const MotionHypothesis& found, const Candidate& candidate);
  void widen(const PairSearch& pair, const Belief& belief, Step& step);
  std::string doubtWords(const PairSearch& pair, const Candidate& candidate, const Belief& belief) const;
  std::string endOutage(const Outcome& outcome, const MotionHypothesis& found);
  bool isDoubtful(const Belief& belief) const;
  void rememberRolled(PairSearch& pair, Step& step);
  void admitReadout(const PairSearch& pair, const std::optional<MeasuredPair>& measured, Step& step);
  void finish(const PairSearch& pair, Step& step);

  VisualOdometryOptions options_;
  Eigen::Isometry3d T_base_camera_;
  SearchTools tools_;
  Revisit revisit_;
  WindowOptimizer optimizer_;
  OdometryState state_;
};

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options) : impl_(std::make_unique<Impl>(options)) {}
VisualOdometry::~VisualOdometry() = default;

OdometryResult VisualOdometry::update(const StereoFeatures& features, const std::optional<MotionGuess>& guess) {
  return impl_->update(features, guess);
}
void VisualOdometry::reset() {
  impl_->reset();
}
void VisualOdometry::breakStream() {
  impl_->breakStream();
}
void VisualOdometry::takePose(const Matrix6d& covariance) {
  impl_->takePose(covariance);
}
const Eigen::Isometry3d& VisualOdometry::lastPose() const {
  return impl_->lastPose();
}
void VisualOdometry::configure(const VisualOdometryOptions& options) {
  impl_->configure(options);
}
const VisualOdometryOptions& VisualOdometry::options() const {
  return impl_->options();
}
void VisualOdometry::mountAt(const Eigen::Isometry3d& T_base_camera) {
  impl_->mountAt(T_base_camera);
}
std::vector<Eigen::Vector3d> VisualOdometry::mapPoints() const {
  return impl_->mapPoints();
}

VisualOdometry::Impl::Impl(const VisualOdometryOptions& options)
    : options_(checked(options).withOneNoise()),
      T_base_camera_(lookingAhead()),
      tools_(options_),
      revisit_(FeatureMatcherOptions(), options_.motion, alignmentWith(options_.noise)),
      optimizer_(windowWith(options_.noise)),
      state_(options_, 0) {}

void VisualOdometry::Impl::configure(const VisualOdometryOptions& options) {
  options_ = checked(options).withOneNoise();
  tools_ = SearchTools(options_);
  revisit_ = Revisit(FeatureMatcherOptions(), options_.motion, alignmentWith(options_.noise));
  optimizer_ = WindowOptimizer(windowWith(options_.noise));
  state_.prior.configure(options.tracking);
}

void VisualOdometry::Impl::mountAt(const Eigen::Isometry3d& T_base_camera) {
  checkRigid(T_base_camera, "the camera's pose on the base");
  const Eigen::Isometry3d T_before_now = T_base_camera_.inverse() * T_base_camera;
  const bool is_same = T_base_camera.matrix() == T_base_camera_.matrix();
  T_base_camera_ = T_base_camera;
  if (is_same || !state_.started) return;
  breakStream();
  state_.forgetMaps();  // they are in the old camera's axes
  state_.forgetRig(options_);
  state_.T_origin_camera = orthonormalised(T_before_now.inverse() * state_.T_origin_camera * T_before_now);
  state_.covariance.predict(T_before_now, Matrix6d::Zero());
}

void VisualOdometry::Impl::takePose(const Matrix6d& covariance) {
  OdometryResult given;
  given.has_pose = true, given.pose_covariance = covariance;
  if (const std::string defect = given.defect(); !defect.empty()) throw std::invalid_argument(defect);
  state_.covariance.reset(covariance);
  state_.earlier.reset();  // its poses are from before
  ++state_.epoch;
  if (!state_.interrupted) return;
  state_.map.reset();
  state_.started = false;
}

OdometryResult VisualOdometry::Impl::update(const StereoFeatures& given, const std::optional<MotionGuess>& guess) {
  refuse(given);
  if (guess) guess->check();
  if (state_.last_stamp) state_.doubt.fade(state_.secondsUntil(given.stamp));
  PairSearch pair(options_, tools_, state_, given, guess);

  // Nothing else of the state has changed so far, and from here on no input is rejected.
  Stopwatch stopwatch;
  begin(pair, guess);
  const std::optional<MeasuredPair> measured = measuredPair(pair);
  if (measured)
    state_.rig.right_delay.updateOtherPair(measured->rows, measured->dt,
                                           options_.noise.corner * state_.rig.noise.scale());
  const std::vector<Evidence> evidence = evidenceAgainst(pair, measured);
  const Outcome outcome = judged(pair);
  Step step = outcome.candidate ? apply(outcome, pair, evidence) : unmeasured(pair, outcome.refusal, evidence);
  admitReadout(pair, measured, step);
  state_.rig.learn(pair.features(), measured ? &*measured : nullptr, pair.found(), pair.rotation(),
                   step.state == TrackingState::kTracking && pair.scene());
  finish(pair, step);
  rememberRolled(pair, step);
  step.time = stopwatch.lap();
  const OdometryResult result =
      checkedResult(state_.report(pair.features(), pair.givenIndices(), pair.found(), step, floor()));
  if (options_.calibration.enabled && options_.calibration.readout == 0.0)
    state_.shutter.setReadout(state_.rig.readout.usableValue());
  // A driver's fault is short: a calibration that lasts is new.
  if (result.has_pose && pair.refutesCamera() &&
      1e-9 * static_cast<double>(given.stamp - *state_.lens_stamp) > options_.tracking.max_gap)
    state_.recalibrate(options_, given);
  return result;
}

/// The only way out of update(): no result leaves with a number that is not finite or an indefinite covariance.
OdometryResult VisualOdometry::Impl::checkedResult(OdometryResult result) {
  const std::string defect = result.defect();
  if (defect.empty()) {
    if (result.has_pose) state_.last_sound = result;
    return result;
  }
  state_.recover(options_);
  OdometryResult lost;
  lost.state = TrackingState::kLost;
  lost.reason = "defect of the odometry: " + defect + "; goes on from the last sound pose. Please report it";
  lost.stamp = result.stamp, lost.epoch = result.epoch, lost.dt = result.dt;
  lost.features = result.features, lost.matches = result.matches, lost.distance = state_.distance;
  return lost;
}

void VisualOdometry::Impl::refuse(const StereoFeatures& features) const {
  features.check();
  if (state_.last_stamp && features.stamp <= *state_.last_stamp)
    throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                std::to_string(*state_.last_stamp) + " ns");
}

/// The pair with its measured motion; none without a motion, or with one that spans an outage.
std::optional<MeasuredPair> VisualOdometry::Impl::measuredPair(const PairSearch& pair) const {
  const MotionHypothesis& found = pair.found();
  if (!found.motion.success || state_.interrupted || !(pair.dt() > 0.0)) return std::nullopt;
  const StereoFeatures& taken = pair.taken();
  const Eigen::Isometry3d& motion = found.motion.T_current_reference;
  const double since = state_.prior.interval(state_.map->secondsUntil(taken), motion);
  return MeasuredPair{
      taken, state_.prior.interval(pair.dt(), motion), motion, since,
      rowMotions(taken, found, since, state_.rig.row_pattern, taken.right_delay + state_.rig.calibration.delay())};
}

/// Evidence of the pair that its motion is not the camera's.
std::vector<Evidence> VisualOdometry::Impl::evidenceAgainst(const PairSearch& pair,
                                                            const std::optional<MeasuredPair>& measured) const {
  const bool continues = pair.kind() == PairSearch::kContinues;
  // A motion between the map, which is from before the rotation, and disparities that are rotated may err.
  std::vector<Evidence> evidence{
      {pair.rotation().log_odds, pair.rotation().words()},
      {pair.rotation().log_odds_of_other_moment, "the right image seemed to be of another moment"}};
  if (pair.features().report.refused) evidence.push_back({kCertain, "left and right did not belong together"});
  // A map that begins after such a pair may have a late right image, too: nothing else has shown its disparities.
  if (state_.outage.hasRefused() && pair.scene() && state_.fallback_map && &pair.scene()->map == &*state_.fallback_map)
    evidence.push_back({kCertain, "left and right of pairs before it did not belong together", true});
  if (continues)
    evidence.push_back({pair.logOddsOfFrozen(), "images as of the previous pair, by a stop or a frozen driver", true});
  // After a short gap, the views may not be of one rigid world, and the next map would be as wrong.
  if (continues && !pair.found().motion.success && pair.found().agreement.matches >= kManyMatches &&
      pair.dt() <= options_.tracking.max_gap)
    evidence.push_back({kCertain, "many matches agreed on no motion", true});
  if (!measured) return evidence;
  const RightCameraDelay::OtherPair other = state_.rig.right_delay.otherPair(measured->dt);
  evidence.push_back({other.log_odds, other.words()});
  evidence.push_back(
      {kUnsuspected + state_.prior.logRatioOfSwap(measured->T_current_reference.inverse(), measured->since_reference),
       "neighbouring pairs seemed to have changed places"});
  return evidence;
}

/// Updates what each pair changes, whatever its motion.
void VisualOdometry::Impl::begin(const PairSearch& pair, const std::optional<MotionGuess>& guess) {
  const StereoFeatures& features = pair.features();
  if (state_.camera && *state_.camera != features.camera) state_.forgetRig(options_);
  state_.camera = features.camera;
  state_.lens = pair.lens();
  if (!pair.refutesCamera()) state_.lens_stamp = features.stamp;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  if (pair.dt() <= options_.tracking.max_gap) state_.prior.noteInterval(pair.dt());
  state_.outage.extend(pair.dt(), guess, state_.prior);
  if (features.report.refused) state_.outage.noteRefused();
  const RigEstimate before = state_.rig.calibration.estimate();
  // A clock's jump ages no rig.
  RigEstimate::Matrix step = state_.rig.calibration.predict(std::min(pair.dt(), options_.tracking.max_gap));
  if (pair.rotation().log_odds > 0.0) step += state_.rig.rotate(pair.rotation(), features.camera);
  state_.walkRig(before, step);
}

/// Whether the pair joins the map: its motion may be refused before or after the adjustment.
VisualOdometry::Impl::Outcome VisualOdometry::Impl::judged(PairSearch& pair) {
  Outcome outcome;
  const MotionHypothesis& found = pair.found();
  outcome.refusal = found.motion.reason;
  if (!found.motion.success) return outcome;
  const MotionScene& scene = *pair.scene();
  outcome.since = scene.map.secondsUntil(pair.features());
  outcome.in_fallback = state_.fallback_map && &scene.map == &*state_.fallback_map;
  outcome.starts_again = outcome.in_fallback && !state_.fallback_has_pose;
  outcome.in_earlier_map = state_.earlier && &scene.map == &state_.earlier->map;
  outcome.refusal =
      state_.prior.tooFast(found.motion.T_current_reference.inverse(), found.motion.covariance, outcome.since);
  if (!outcome.refusal.empty()) return outcome;
  Candidate candidate = adjustBeyondDoubt(pair);
  outcome.refusal = tools_.motions.chanceWords(scene, found);
  if (outcome.refusal.empty())
    outcome.refusal = state_.prior.tooFast(candidate.motion, found.motion.covariance, outcome.since);
  if (outcome.refusal.empty())
    outcome.candidate = std::move(candidate);
  else
    outcome.refusal += " after the adjustment";
  return outcome;
}

/// The step of a pair that does not join the map.
VisualOdometry::Impl::Step VisualOdometry::Impl::unmeasured(const PairSearch& pair, const std::string& why,
                                                            const std::vector<Evidence>& evidence) {
  state_.doubt.raise(evidence);
  if (pair.kind() == PairSearch::kFrozen) return holdPose(pair.dt(), state_);
  if (pair.kind() == PairSearch::kContinues) return predictMotion(options_, pair.features(), pair.dt(), why, state_);
  return startMap(options_, pair.features(), state_);
}

/// The pair joins the map.
VisualOdometry::Impl::Step VisualOdometry::Impl::apply(const Outcome& outcome, const PairSearch& pair,
                                                       const std::vector<Evidence>& evidence) {
  const MotionHypothesis& found = pair.found();
  if (outcome.starts_again) state_.startAgain();
  if (outcome.in_earlier_map) state_.returnToEarlierMap();
  if (outcome.in_fallback) state_.covariance.beginMap();
  const Belief belief = state_.doubt.update(*pair.scene(), found, evidence);
  commit(*outcome.candidate, belief);
  Step step = measure(found, *outcome.candidate);
  const Matrix6d measured = step.covariance;
  widen(pair, belief, step);
  const std::string doubt = doubtWords(pair, *outcome.candidate, belief);
  step.state = doubt.empty() && !outcome.starts_again ? TrackingState::kTracking : TrackingState::kDegraded;
  step.probability = belief.probability;
  step.changes_epoch = outcome.starts_again || outcome.in_earlier_map;
  if (!doubt.empty()) step.reason = "doubtful: " + doubt;
  // A motion that is probably not the camera's predicts nothing.
  if (belief.probability >= 0.5)
    state_.prior.takeVelocity(pair.features().stamp, found.motion.T_current_reference.inverse(), outcome.since,
                              measured, doubt.empty(), step.covariance - measured);
  if (options_.planar.planar) {
    const std::string off = state_.floor.note(*floor(), state_.map->newestPose(), outcome.candidate->motion);
    if (step.reason.empty()) step.reason = off;
  }
  const std::string end = endOutage(outcome, found);
  if (!end.empty()) step.reason = end + (step.reason.empty() ? "" : "; " + step.reason);
  if (state_.map->newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// A motion is measured: forgets what an outage left. Returns how it ended; empty if there was none.
std::string VisualOdometry::Impl::endOutage(const Outcome& outcome, const MotionHypothesis& found) {
  state_.outage.end();
  state_.fallback_map.reset();
  if (outcome.in_earlier_map) state_.earlier.reset();
  if (!std::exchange(state_.interrupted, false)) return "";
  if (outcome.starts_again) return kStartedAgain;
  if (outcome.in_fallback) return "goes on where the guess had the camera";
  return "re-acquired by " + std::to_string(found.agreement.inliers) + " points of the map";
}

/// Adjusts the map with the pair. If it rejects so many inliers that the motion is not beyond doubt, all hypotheses
/// compete.
VisualOdometry::Impl::Candidate VisualOdometry::Impl::adjustBeyondDoubt(PairSearch& pair) {
  MotionHypothesis& found = pair.found();
  const MotionSearch& motions = tools_.motions;
  const double most = largestDoubt(options_.tracking);
  const bool is_sound = !state_.doubt.lasts(), was_beyond_doubt = motions.isBeyondDoubt(found, most);
  Candidate candidate = adjust(pair, is_sound);
  const std::size_t adjusted = found.sightings.size();
  found.countInliers(candidate.adjustment.rejected);
  if (!was_beyond_doubt || motions.isBeyondDoubt(found, most)) return candidate;
  MotionScene scene = *pair.scene();
  scene.all_compete = true;
  MotionHypothesis chosen = motions.find(scene, most);
  if (!chosen.motion.success) return candidate;
  const Eigen::Isometry3d T_adjusted = std::exchange(found, std::move(chosen)).motion.T_current_reference;
  // Mostly the first motion prevails, and its adjustment is known.
  if (found.sightings.size() != adjusted || found.motion.T_current_reference.matrix() != T_adjusted.matrix())
    candidate = adjust(pair, is_sound);
  found.countInliers(candidate.adjustment.rejected);
  return candidate;
}

/// Adjusts a copy of the map with the pair in it.
VisualOdometry::Impl::Candidate VisualOdometry::Impl::adjust(const PairSearch& pair, bool may_recall) {
  const StereoFeatures& features = pair.features();
  const MotionHypothesis& found = pair.found();
  const LocalMap& before = pair.scene()->map;
  const Eigen::Isometry3d T_previous_origin = before.newestPose();
  state_.candidate = before;
  LocalMap& map = *state_.candidate;
  Candidate candidate;
  candidate.calibration = state_.rig.calibration.calibration();
  candidate.delay = state_.rig.calibration.delay();
  map.insert(alignmentWith(options_.noise), features, state_.pairs,
             found.motion.T_current_reference * T_previous_origin, found.sightings, candidate.calibration);
  candidate.T_keyframe_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && may_recall) revisit_.recall(features, candidate.calibration, map);
  const std::optional<Floor> floor = this->floor();
  // The adjustment has one calibration for all pairs, so a delay shifts them by the window's mean rate.
  const auto [T_oldest_newest, seconds] = map.motionOfWindow();
  candidate.calibration_by_rig = RigEstimate::shape(
      features.camera, logSO3(T_oldest_newest.linear()) / state_.prior.interval(seconds, T_oldest_newest));
  candidate.adjustment =
      map.adjust(optimizer_, state_.rig.calibration.prior(candidate.calibration_by_rig), candidate.calibration, floor);
  map.noteVariance(state_.rig.noise.ofPair(candidate.adjustment.newest_square, candidate.adjustment.newest_measured));
  candidate.adjustment.since_keyframe *= map.varianceOfMotion();
  candidate.adjustment.growth *= map.varianceOfMotion();
  // The adjustment fixes the window's first pose: its error of height and tilt is corrected by moving the whole map.
  if (floor) map.moveTo(floor->settled(map.newestPose(), state_.covariance.value()));
  map.renewAppearance(features, found.sightings);
  // A shift of the whole map by the adjustment is no motion.
  const Eigen::Isometry3d T_before_after = candidate.T_keyframe_origin.inverse() * map.poseBeforeNewest();
  candidate.motion = T_previous_origin * T_before_after * map.newestPose().inverse();
  candidate.distance = (map.poseBeforeNewest() * map.newestPose().inverse()).translation().norm();
  return candidate;
}

/// Adds second moments to the covariances: of rivals, of places that look alike, and of an unexpected innovation. A
/// doubtful motion has the moment of its doubt as well.
void VisualOdometry::Impl::widen(const PairSearch& pair, const Belief& belief, Step& step) {
  const MotionScene& scene = *pair.scene();
  const MotionHypothesis& found = pair.found();
  const auto add = [&](const Matrix6d& motion, const Matrix6d& pose) {
    step.covariance += motion;
    state_.covariance.addDoubt(motion, pose);
  };
  add(found.rivals_moment, found.rivals_moment);
  add(unexpected(scene, found), Matrix6d::Zero());  // stamps change the velocity, not the pose
  if (isDoubtful(belief)) add(belief.moment, belief.pose_moment);
  if (!scene.place) return;
  const Matrix6d of_places = scene.place->mixture.moment();
  step.covariance += of_places;
  state_.covariance.inflate(of_places);
}

/// Reason, if a motion has too small a probability or too large a covariance; else empty.
std::string VisualOdometry::Impl::doubtWords(const PairSearch& pair, const Candidate& candidate,
                                             const Belief& belief) const {
  if (isDoubtful(belief)) return belief.reason;
  const MotionScene& scene = *pair.scene();
  const MotionHypothesis& found = pair.found();
  Matrix6d covariance = candidate.adjustment.since_keyframe + unexpected(scene, found);
  if (scene.place) covariance += scene.place->mixture.moment();
  const double deviation = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  if (deviation <= options_.tracking.doubtful_deviation + kTolerableRatio * candidate.distance) return "";
  std::ostringstream words;
  if (found.innovation > noiseGate(6))
    words << innovationWords(found);
  else
    words << "a distance of " << candidate.distance << " m with a standard deviation of " << deviation
          << " m exceeds tracking/doubtful_deviation";
  return words.str() + (scene.place ? ": " + scene.place->mixture.cause() : "");
}

bool VisualOdometry::Impl::isDoubtful(const Belief& belief) const {
  return belief.probability < options_.tracking.probability;
}

void VisualOdometry::Impl::commit(const Candidate& candidate, const Belief& belief) {
  std::swap(state_.map, state_.candidate);
  // Points of a mover agree with each other: a doubtful pair does not confirm them.
  if (isDoubtful(belief)) state_.map->discountNewest();
  const LocalMap::Adjustment& adjustment = candidate.adjustment;
  if (!adjustment.success) return;
  state_.rig.calibration.update(state_.map->oldestId(), state_.map->newestId(), candidate.calibration_by_rig,
                                candidate.calibration, adjustment.calibration_information);
  if (isDoubtful(belief)) return;
  state_.rig.noise.learnPair(adjustment.newest_square);
  if (adjustment.common_disparity_square) state_.rig.calibration.updateCommon(*adjustment.common_disparity_square);
}

/// The motion between the two reported poses, and its covariance.
VisualOdometry::Impl::Step VisualOdometry::Impl::measure(const MotionHypothesis& found, const Candidate& candidate) {
  const LocalMap& map = *state_.map;
  Step step;
  step.rejected_features = candidate.adjustment.rejected;
  step.T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  if (!candidate.adjustment.success) {
    // It is measured against the map's points all the same.
    step.covariance = state_.covariance.update(*step.T_previous_current, found.motion.covariance);
    return step;
  }
  step.covariance = state_.covariance.update(*step.T_previous_current, candidate.adjustment.since_keyframe,
                                             candidate.adjustment.growth);
  const Matrix6d by_rig = state_.covariance.updateExposure(
      candidate.adjustment.by_calibration * candidate.calibration_by_rig, state_.rig.calibration.estimate(),
      RigEstimate::of(*state_.camera, candidate.calibration, candidate.delay));
  // The motion between two reported poses includes the map's correction of the first one. It is found as a perturbation
  // of the key frame, and reported as one of the newest pair.
  step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                    logSE3(candidate.T_keyframe_origin * map.poseBeforeNewest().inverse());
  state_.covariance.coverCorrection(step.correction);
  const bool by_chance = mahalanobisSquare(step.correction, step.covariance) <= noiseGate(6);
  step.covariance += missingCovariance(step.covariance, step.correction) + by_rig;
  if (by_chance) return step;
  std::ostringstream reason;
  reason << "the map corrected the pose by " << step.correction.head<3>().norm() << " m and "
         << step.correction.tail<3>().norm() << " rad";
  step.reason = reason.str();
  return step;
}

/// Widens covariances by what is unknown of the shutter's readout.
void VisualOdometry::Impl::admitReadout(const PairSearch& pair, const std::optional<MeasuredPair>& measured,
                                        Step& step) {
  if (!measured || !step.T_previous_current || !options_.calibration.enabled || options_.calibration.readout != 0.0)
    return;
  const Matrix6d moment = state_.rig.readout.momentOf(measured->features, pair.found(), measured->since_reference,
                                                      state_.shutter.readout());
  step.covariance += moment;
  state_.covariance.addDoubt(moment, moment);
}

/// Widens covariances by the error of the pair's velocity, and keeps the pair until the next motion is known.
void VisualOdometry::Impl::rememberRolled(PairSearch& pair, Step& step) {
  const auto ends_with_it = [&](const std::optional<LocalMap>& map) {
    return map && map->newestStamp() == pair.features().stamp;
  };
  if (!pair.rolled() || (!ends_with_it(state_.map) && !ends_with_it(state_.fallback_map))) return;
  RolledPair& rolled = *pair.rolled();
  if (!pair.found().motion.success || !step.T_previous_current) {
    rolled.forgetMotion();
  } else {
    const Matrix6d moment = state_.shutter.covarianceByVelocity(rolled);
    step.covariance += moment;
    state_.covariance.addDoubt(moment, moment);
  }
  if (state_.newest && rolled.mean_velocity) state_.shutter.learn(*state_.newest, *rolled.mean_velocity);
  state_.newest = std::move(pair.rolled());
}

/// Updates the state by the pair's step.
void VisualOdometry::Impl::finish(const PairSearch& pair, Step& step) {
  const StereoFeatures& features = pair.features();
  std::optional<bool> stood;
  if (step.state == TrackingState::kTracking && step.T_previous_current)
    stood = mahalanobisSquare(Vector6d(logSE3(*step.T_previous_current)), step.covariance) < noiseGate(6);
  state_.images.remember(pair.whole(), stood);
  state_.frozen = pair.kind() == PairSearch::kFrozen;
  if (pair.repeatsAPart() && step.reason.empty())
    step.reason = "a part of the left image repeats that of the previous pair";
  if (pair.refutesCamera() && step.reason.empty())
    step.reason = "camera_info changed, but the images did not: the calibration before it is used";
  const bool since_pose = step.T_previous_current && state_.last_pose_stamp;
  step.dt = since_pose ? static_cast<double>(features.stamp - *state_.last_pose_stamp) * 1e-9 : pair.dt();
  if (step.T_previous_current) state_.move(*step.T_previous_current);
  if (!step.hasPose()) return;
  state_.last_pose_stamp = features.stamp;
  state_.outage.havePose();
}

std::optional<Floor> VisualOdometry::Impl::floor() const {
  if (!options_.planar.planar) return std::nullopt;
  return Floor(options_.planar, T_base_camera_, state_.floor.height());
}

std::vector<Eigen::Vector3d> VisualOdometry::Impl::mapPoints() const {
  return state_.map ? state_.map->positions() : std::vector<Eigen::Vector3d>();
}

}  // namespace sdvo
