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

Noise noiseOf(const VisualOdometryOptions& options) {
  return {options.map.corner_sigma, options.map.reference_sigma, options.window.common_disparity_sigma};
}

/// Of the motion's inliers over the last `dt` s, as the motion has them: corners have more noise.
std::vector<RowMotion> rowMotions(const StereoFeatures& features, const MotionHypothesis& found, double dt) {
  std::vector<RowMotion> rows;
  rows.reserve(found.motion.inliers.size());
  for (const int i : found.motion.inliers) {
    const auto [reference, current, distance] = found.matches[static_cast<std::size_t>(i)];
    const Eigen::Vector3d now = found.motion.T_current_reference * found.view->rows.positions[reference];
    rows.push_back({(features.camera.project(now).y() - found.view->pixels[reference].y) / dt, features.dv[current]});
  }
  return rows;
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

VisualOdometry::State::State(const VisualOdometryOptions& options)
    : calibration(options.calibration),
      right_delay(options.calibration.right_delay),
      prior(options.tracking),
      noise(noiseOf(options)) {}

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options)
    : options_(checked(options)),
      T_base_camera_(lookingAhead()),
      search_(options.matcher, options.motion, options.alignment),
      reacquisition_(options.matcher, options.motion),
      revisit_(options.matcher, options.motion, options.alignment),
      optimizer_(options.window),
      state_(options) {}

void VisualOdometry::configure(const VisualOdometryOptions& options) {
  options_ = checked(options);
  search_ = MotionSearch(options.matcher, options.motion, options.alignment);
  reacquisition_ = Reacquisition(options.matcher, options.motion);
  revisit_ = Revisit(options.matcher, options.motion, options.alignment);
  optimizer_ = WindowOptimizer(options.window);
  state_.prior.configure(options.tracking);
}

void VisualOdometry::reset() {
  state_ = State(options_);
  ++epoch_;
}

void VisualOdometry::breakStream() {
  state_.interrupted = true;
  state_.prior.interrupt();
}

void VisualOdometry::forgetTime() {
  breakStream();
  state_.map.reset();  // how long ago it was seen is unknown
  state_.last_stamp.reset();
  state_.prior.forget();
}

void VisualOdometry::mountAt(const Eigen::Isometry3d& T_base_camera) {
  const Eigen::Isometry3d T_before_now = T_base_camera_.inverse() * T_base_camera;
  const bool is_same = T_base_camera.matrix() == T_base_camera_.matrix();
  T_base_camera_ = T_base_camera;
  if (is_same || !state_.started) return;
  breakStream();
  state_.map.reset();  // it is in the old camera's axes
  forgetRig();
  state_.T_origin_camera = orthonormalised(T_before_now.inverse() * state_.T_origin_camera * T_before_now);
  state_.covariance.advance(T_before_now, Matrix6d::Zero());
}

void VisualOdometry::takePose(const Matrix6d& covariance) {
  state_.covariance.assume(covariance);
  ++epoch_;
  if (!state_.interrupted) return;
  state_.map.reset();
  state_.started = false;
}

/// The part of a scale error that a longer way adds.
Matrix6d GuessedMotion::add(const MotionGuess& guess) {
  constexpr double kLeast = 1e-3;  // m and rad (chosen): no odometry stands still to less
  const Vector6d motion = logSE3(guess.T_previous_current);
  const auto grow = [&](double& way, double by) {
    const double before = way;
    way += std::max(by, kLeast);
    return guess.error * guess.error * (way * way - before * before);
  };
  Vector6d variance;
  variance.head<3>().setConstant(grow(distance_, motion.head<3>().norm()));
  variance.tail<3>().setConstant(grow(angle_, motion.tail<3>().norm()));
  return variance.asDiagonal();
}

/// The motion of a guess. The translation that a gyro lacks is the prior's.
Eigen::Isometry3d VisualOdometry::motionOf(const MotionGuess& guess, double dt) const {
  Eigen::Isometry3d motion = guess.T_previous_current;
  if (guess.rotation_only) motion.translation() = state_.prior.velocity().value_or(Vector6d::Zero()).head<3>() * dt;
  return motion;
}

/// The covariance by which an unseen motion grew over the last `dt` s.
Matrix6d VisualOdometry::unseen(double dt) const {
  return state_.prior.unseen(state_.unseen) - state_.prior.unseen(state_.unseen - dt);
}

/// Takes note of a guess, or that there is none, for as long as there is no pose.
void VisualOdometry::follow(const std::optional<MotionGuess>& guess, double dt) {
  if (!guess) state_.followed.reset();
  if (!state_.followed) return;
  State::Followed& followed = *state_.followed;
  const Eigen::Isometry3d motion = motionOf(*guess, dt);
  const Matrix6d carried = adjoint(motion.inverse());
  Matrix6d covariance = state_.guessed.add(*guess);
  if (guess->rotation_only) covariance.topLeftCorner<3, 3>() = unseen(dt).topLeftCorner<3, 3>();
  followed.motion = followed.motion * motion;
  followed.covariance = carried * followed.covariance * carried.transpose() + covariance;
  followed.rotation_only |= guess->rotation_only;
}

OdometryResult VisualOdometry::update(const StereoFeatures& given, const std::optional<MotionGuess>& guess) {
  refuse(given);
  // A lens that focuses changes the camera with every pair; the pixels of one map are those of one camera.
  const bool is_refocused = state_.camera && *state_.camera != given.camera && state_.camera->isLike(given.camera);
  StereoFeatures refocused, new_part;
  const StereoFeatures& whole = is_refocused ? refocused = given.seenBy(*state_.camera) : given;
  const std::vector<int> new_rows = state_.images.newRows(whole);
  const bool is_torn = static_cast<int>(new_rows.size()) < whole.count();
  const StereoFeatures& taken = is_torn ? new_part = whole.select(new_rows) : whole;
  const double dt = state_.last_stamp ? static_cast<double>(taken.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  const bool continued = state_.map && state_.map->continuedBy(taken);
  const bool frozen = !state_.interrupted && isFrozen(taken, dt, guess);
  const std::optional<StereoFeatures> in_step = continued && !frozen ? inStep(taken, dt, guess) : std::nullopt;
  const StereoFeatures& features = in_step ? *in_step : taken;
  const std::optional<MotionScene> scene = !continued || frozen ? std::nullopt
                                           : state_.interrupted ? reacquire(features)
                                                                : std::optional(sceneOf(features, dt, guess));
  MotionHypothesis found;
  if (scene) found = search_.find(*scene, largestDoubt());

  // Nothing has changed so far, and from here on nothing is refused.
  Stopwatch stopwatch;
  begin(features, dt);
  follow(guess, dt);
  watchShutters(taken, dt, found);
  Step step;
  if (!continued || (state_.interrupted && !found.motion.success))
    step = seed(features);
  else if (frozen)
    step = hold(dt);
  else if (!found.motion.success)
    step = predict(features, dt, found.motion.reason);
  else
    step = extendMap(features, *scene, found, dt);
  // Unless the camera went unseen, the views may not be of one rigid world, and the next map would be as wrong.
  if (scene && !found.motion.success && found.agreement.matches >= kManyMatches && dt <= options_.tracking.max_gap)
    state_.doubt.raise(CarriedDoubt::kCertain, "many matches agreed on no motion");
  // The depths of its points may be those of a wrong rig.
  if (features.report.refused && step.state == TrackingState::kLost) state_.map.reset();
  state_.doubt.pass();
  state_.images.remember(whole, frozen);
  if (is_torn && step.reason.empty()) step.reason = "a part of the left image repeats that of the previous pair";
  step.dt = step.T_previous_current ? static_cast<double>(features.stamp - state_.last_pose_stamp) * 1e-9 : dt;
  if (step.T_previous_current) move(*step.T_previous_current);
  if (step.state == TrackingState::kTracking || step.state == TrackingState::kDegraded)
    state_.last_pose_stamp = features.stamp, state_.followed = State::Followed();
  step.time = stopwatch.lap();
  OdometryResult result = report(features, found, step);
  for (FeatureFlow& flow : result.flow) flow.current = new_rows[static_cast<std::size_t>(flow.current)];
  return result;
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
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  if (guess) turn.linear() = guess->T_previous_current.linear();
  std::optional<Eigen::Isometry3d> predicted;
  if (state_.prior.velocity()) predicted = state_.prior.predicted(dt).motion;
  return state_.images.areFrozen(features, turn, true) || state_.images.areFrozen(features, predicted, false);
}

/// The map, the pair, and the motion between them as it is expected: what was already covered by predicted pairs, and
/// from there on the velocity or the guess.
MotionScene VisualOdometry::sceneOf(const StereoFeatures& features, double dt,
                                    const std::optional<MotionGuess>& guess) const {
  const MotionPrior& prior = state_.prior;
  MotionScene scene{*state_.map,
                    state_.calibration.calibration(),
                    features,
                    {},
                    {},
                    {},
                    state_.usual_agreement,
                    state_.doubt.logOdds() > largestDoubt(),
                    options_.tracking.doubtful_deviation,
                    state_.noise};
  const Eigen::Isometry3d T_reference_previous = state_.map->newestPose() * state_.T_origin_camera;
  const double since = secondsSinceMap(features);
  if (const auto confirmed = prior.confirmed(state_.map->newestStamp(), since)) scene.prior.push_back(*confirmed);
  if (prior.velocity() && dt <= options_.tracking.max_gap)
    scene.T_current_reference = (T_reference_previous * prior.predicted(dt).motion).inverse();
  if (guess) {
    scene.guess = (T_reference_previous * motionOf(*guess, dt)).inverse();
    if (!scene.prior.empty()) scene.prior.push_back(prior.around(scene.guess->inverse(), since));
  }
  return scene;
}

/// The features as of one moment, if the right camera is known to be late: by the velocity that is expected, then by
/// the one that these show.
std::optional<StereoFeatures> VisualOdometry::inStep(const StereoFeatures& taken, double dt,
                                                     const std::optional<MotionGuess>& guess) const {
  const std::optional<Vector6d>& velocity = state_.prior.velocity();
  if (state_.right_delay.compensated() == 0.0 || !velocity || dt > options_.tracking.max_gap) return std::nullopt;
  StereoFeatures features = state_.right_delay.inStep(taken, dt, *velocity);
  if (state_.interrupted) return features;
  const MotionHypothesis found = search_.find(sceneOf(features, dt, guess), largestDoubt());
  if (!found.motion.success) return features;
  return state_.right_delay.inStep(taken, dt,
                                   logSE3(found.motion.T_current_reference.inverse()) / secondsSinceMap(taken));
}

/// Whether all rows of both images are of one moment, and the pairs in their order.
void VisualOdometry::watchShutters(const StereoFeatures& taken, double dt, const MotionHypothesis& found) {
  if (!found.motion.success || state_.interrupted || !(dt > 0.0)) return state_.right_delay.interrupt();
  const double since = secondsSinceMap(taken);
  const Eigen::Isometry3d T_reference_current = found.motion.T_current_reference.inverse();
  const Vector6d velocity = logSE3(T_reference_current) / since;
  state_.readout.add(taken.camera, found.motion.T_current_reference, found.correspondences, found.motion.inliers,
                     velocity);
  state_.right_delay.measure(taken, rowMotions(taken, found, since), dt, velocity);
  state_.doubt.raise(CarriedDoubt::kUnsuspected + state_.prior.logRatioOfSwap(T_reference_current, since),
                     "neighbouring pairs seemed to have changed places");
  constexpr double kAnother = 0.5;  // of the interval: the right image is nearer to another pair's
  const double known = state_.right_delay.compensated();
  const double delay = std::abs(known) > kAnother * dt ? known : state_.right_delay.partner();
  if (delay == 0.0) return;
  std::ostringstream cause;
  cause << "the right image seemed to be that of another pair, taken " << std::round(1e3 * std::abs(delay)) << " ms "
        << (delay < 0.0 ? "earlier" : "later");
  state_.doubt.raise(CarriedDoubt::kCertain, cause.str());
}

/// Log-odds of being misled above which a motion is doubtful.
double VisualOdometry::largestDoubt() const {
  return logOdds(1.0 - options_.tracking.probability);
}

double VisualOdometry::secondsSinceMap(const StereoFeatures& features) const {
  return static_cast<double>(features.stamp - state_.map->newestStamp()) * 1e-9;
}

/// Looks for the pair in the map from before an outage. How the camera moved meanwhile is unknown.
std::optional<MotionScene> VisualOdometry::reacquire(const StereoFeatures& features) const {
  const auto T_current_newest = reacquisition_.find(*state_.map, features, state_.calibration.calibration());
  if (!T_current_newest) return std::nullopt;
  MotionScene scene = sceneOf(features, 0.0, std::nullopt);
  scene.prior.clear();
  scene.T_current_reference = T_current_newest;
  return scene;
}

/// What was learnt is of another rig.
void VisualOdometry::forgetRig() {
  state_.calibration = CalibrationFilter(options_.calibration);
  state_.right_rotation = RightCameraRotation();
  state_.noise = noiseOf(options_);
  state_.right_delay = RightCameraDelay(options_.calibration.right_delay);
  state_.readout = RowReadout();
}

/// Takes note of the pair, whatever becomes of its motion.
void VisualOdometry::begin(const StereoFeatures& features, double dt) {
  if (state_.camera && *state_.camera != features.camera) forgetRig();
  state_.camera = features.camera;
  state_.last_stamp = features.stamp;
  state_.unseen += dt;
  ++state_.pairs;
  if (dt <= options_.tracking.max_gap) state_.prior.pass(dt);
  // The map is of another rig than this pair.
  const double turned = state_.right_rotation.add(features);
  state_.doubt.raise(CarriedDoubt::kUnsuspected + 0.5 * turned * turned, "the right camera seems to have turned");
  if (features.report.refused) {
    // What the pairs before told of the rig may be wrong already, and those after may be refused again.
    state_.calibration = CalibrationFilter(options_.calibration);
    state_.doubt.raise(CarriedDoubt::kCertain, "left and right did not belong together");
  }
}

/// The sums over pairs without a measurement begin anew.
void VisualOdometry::endOutage() {
  state_.predicted_pairs = 0;
  state_.unseen = 0.0;
  state_.guessed = GuessedMotion();
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
  if (state_.started && state_.followed) {
    step.state = TrackingState::kDegraded;
    step.reason = state_.followed->rotation_only ? "started again as the gyro turned; the translation is predicted"
                                                 : "started again where the guess has the camera";
    if (state_.followed->rotation_only) ++epoch_;
    step.T_previous_current = state_.followed->motion;
    step.covariance = state_.followed->covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
    state_.covariance.assume(state_.covariance.value());
  } else if (state_.started) {
    ++epoch_;
    const double unseen = std::max(0.0, static_cast<double>(features.stamp - state_.last_pose_stamp) * 1e-9);
    state_.covariance.restart(state_.prior.unseen(unseen));
    step.state = TrackingState::kDegraded;
    step.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state_.started = true;
  state_.interrupted = false;
  endOutage();
  state_.map.emplace(options_.map);
  const Eigen::Isometry3d T_previous_current = step.T_previous_current.value_or(Eigen::Isometry3d::Identity());
  state_.map->insert(options_.alignment, features, state_.pairs,
                     (state_.T_origin_camera * T_previous_current).inverse(), {}, state_.calibration.calibration());
  return step;
}

/// The pair joins the map unless the adjustment refutes its motion.
VisualOdometry::Step VisualOdometry::extendMap(const StereoFeatures& features, const MotionScene& scene,
                                               MotionHypothesis& found, double dt) {
  const auto refute = [&](const std::string& why) {
    return state_.interrupted ? seed(features) : predict(features, dt, why);
  };
  const double since = secondsSinceMap(features);
  const Eigen::Isometry3d T_reference_current = found.motion.T_current_reference.inverse();
  std::string refutation = state_.prior.tooFast(T_reference_current, found.motion.covariance, since);
  // What is followed was likely something else already, and this is no motion of the camera: the prior's is likelier.
  if (refutation.empty() && scene.is_doubted && scene.T_current_reference && logOddsMisled(scene, found) > 0.0)
    refutation = innovationWords(found) + ", right after " + state_.doubt.cause();
  if (!refutation.empty()) return refute(refutation);
  const bool is_sound = doubtOf(scene, found).probability >= options_.tracking.probability;
  const Candidate candidate = adjust(features, found, is_sound);
  found.reject(candidate.adjustment.rejected_rows);
  refutation = search_.chanceWords(scene, found);
  if (refutation.empty()) refutation = state_.prior.tooFast(candidate.motion, found.motion.covariance, since);
  if (!refutation.empty()) return refute(refutation + " after the adjustment");

  const Doubt doubt = doubtOf(scene, found);
  state_.doubt.raise(doubt.log_odds, doubt.cause);
  commit(candidate, doubt.probability);
  Step step = measure(found, candidate);
  const Matrix6d measured = step.covariance;
  judge(scene, found, candidate, doubt, step);
  const bool is_confirmed = step.state == TrackingState::kTracking;
  if (is_confirmed) learn(found);
  // A motion that is likely something else's predicts nothing.
  if (doubt.probability >= 0.5)
    state_.prior.measure(features.stamp, T_reference_current, since, measured, is_confirmed,
                         step.covariance - measured);
  if (options_.planar.planar) {
    const std::string off = state_.floor.note(*floor(), state_.map->newestPose());
    if (step.reason.empty()) step.reason = off;
  }
  endOutage();
  if (std::exchange(state_.interrupted, false))
    step.reason = "re-acquired by " + std::to_string(found.agreement.inliers) + " points of the map" +
                  (step.reason.empty() ? "" : "; " + step.reason);
  if (state_.map->newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// Learns what agreement and what noise are usual on this rig.
void VisualOdometry::learn(const MotionHypothesis& confirmed) {
  constexpr double kMemory = 0.9;  // ratio of the past that a pair leaves (chosen)
  constexpr double kMost = 0.95;   // even if all agree, a few need not in the next pair (chosen)
  state_.noise.learn(confirmed.motion.rms);
  const Agreement& agreement = confirmed.agreement;
  if (agreement.lasting_matches == 0) return;
  const double ratio = static_cast<double>(agreement.lasting_inliers) / agreement.lasting_matches;
  state_.usual_agreement += (1.0 - kMemory) * (std::min(ratio, kMost) - state_.usual_agreement);
}

/// Adjusts a copy of the map with the pair in it.
VisualOdometry::Candidate VisualOdometry::adjust(const StereoFeatures& features, const MotionHypothesis& found,
                                                 bool may_recall) {
  const Eigen::Isometry3d T_previous_origin = state_.map->newestPose();
  state_.candidate = state_.map;
  LocalMap& map = *state_.candidate;
  Candidate candidate;
  candidate.calibration = state_.calibration.calibration();
  map.insert(options_.alignment, features, state_.pairs, found.motion.T_current_reference * T_previous_origin,
             found.sightings, candidate.calibration);
  candidate.T_keyframe_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && may_recall) revisit_.recall(features, candidate.calibration, map);
  const std::optional<Floor> floor = this->floor();
  candidate.adjustment = map.adjust(optimizer_, state_.calibration.prior(map.oldestId()), candidate.calibration, floor);
  // The window's first pose does not move in the adjustment: what it carries in height and tilt goes with the whole
  // map.
  if (floor) map.moveTo(floor->settled(map.newestPose(), state_.covariance.value()));
  map.renewLooks(features, found.sightings);
  // What the adjustment did to the map as a whole is no motion.
  const Eigen::Isometry3d T_before_after = candidate.T_keyframe_origin.inverse() * map.poseBeforeNewest();
  candidate.motion = T_previous_origin * T_before_after * map.newestPose().inverse();
  candidate.distance = (map.poseBeforeNewest() * map.newestPose().inverse()).translation().norm();
  return candidate;
}

/// The probability that a motion is not the camera's: it is a rival's, the pair itself misleads, or a pair before did.
VisualOdometry::Doubt VisualOdometry::doubtOf(const MotionScene& scene, const MotionHypothesis& found) const {
  const double rivals = 1.0 / found.probability - 1.0, misled = std::exp(logOddsMisled(scene, found));
  const double carried = std::exp(state_.doubt.logOdds());
  Doubt doubt;
  doubt.log_odds = std::log(rivals + misled);
  doubt.probability = 1.0 / (1.0 + rivals + misled + carried);
  doubt.moment = found.rivals_moment;
  if (!scene.prior.empty()) {
    const ExpectedMotion& expected = scene.prior.front();
    const Vector6d innovation = expected.innovation(found.motion.T_current_reference.inverse());
    doubt.moment += (misled + carried) * doubt.probability * (momentOf(innovation) + expected.covariance);
  }
  std::ostringstream reason;
  if (found.rival && rivals >= std::max(misled, carried)) {
    reason << "two motions in view, of " << found.agreement.inliers << " and " << found.rival->matches
           << " matches, the second with a probability of " << found.rival->probability
           << ": does something move in front of the camera?";
    doubt.cause = "something else moved in view";
  } else {
    reason << (misled >= carried ? innovationWords(found) : "a moment ago " + state_.doubt.cause())
           << ": followed with a probability of " << 1.0 - doubt.probability << " is something else";
    doubt.cause = "the motion changed faster than a vehicle's can";
  }
  doubt.reason = reason.str();
  return doubt;
}

/// The pair's own evidence against its motion.
std::string VisualOdometry::innovationWords(const MotionHypothesis& found) const {
  std::ostringstream words;
  words << "the motion differs from the prior by " << std::sqrt(found.innovation)
        << " standard deviations (tracking/acceleration), " << found.agreement.lasting_inliers << " of "
        << found.agreement.lasting_matches << " lasting points agree";
  return words.str();
}

/// Doubtful is a motion that is the camera's with too small a probability, or that has too large a covariance.
void VisualOdometry::judge(const MotionScene& scene, const MotionHypothesis& found, const Candidate& candidate,
                           const Doubt& doubt, Step& step) {
  std::ostringstream reason;
  Matrix6d covariance = candidate.adjustment.since_keyframe;
  if (found.innovation > noiseGate(6)) {
    // The stamps may be wrong, or the camera did what none does; points cannot tell.
    const Vector6d innovation = scene.prior.front().innovation(found.motion.T_current_reference.inverse());
    covariance += innovation * innovation.transpose();
    step.covariance += innovation * innovation.transpose();
    reason << innovationWords(found);
  }
  if (doubt.probability < options_.tracking.probability) {
    step.covariance += doubt.moment;
    state_.covariance.doubt(doubt.moment);
    reason.str("");
    reason << doubt.reason;
  } else {
    const double deviation = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
    if (deviation <= options_.tracking.doubtful_deviation + kTolerableRatio * candidate.distance) return;
    if (reason.str().empty())
      reason << "a distance of " << candidate.distance << " m with a standard deviation of " << deviation
             << " m exceeds tracking/doubtful_deviation";
  }
  step.state = TrackingState::kDegraded;
  step.reason = "doubtful: " + reason.str();
}

void VisualOdometry::commit(const Candidate& candidate, double probability) {
  std::swap(state_.map, state_.candidate);
  // In doubt, what is followed agrees with itself whatever it is.
  if (probability < options_.tracking.probability) state_.map->discountNewest();
  const LocalMap::Adjustment& adjustment = candidate.adjustment;
  if (!adjustment.success) return;
  state_.calibration.note(state_.map->oldestId(), state_.map->newestId(), candidate.calibration,
                          adjustment.calibration_information);
  if (probability >= options_.tracking.probability && adjustment.common_disparity_square)
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

/// Images that repeat themselves show no motion: the pose stays, as uncertain as the prior makes it meanwhile.
VisualOdometry::Step VisualOdometry::hold(double dt) {
  Step step;
  step.state = TrackingState::kDegraded;
  step.reason = "the images repeat those of the previous pair although the camera moved: is the driver frozen?";
  step.T_previous_current = Eigen::Isometry3d::Identity();
  step.covariance = unseen(dt);
  state_.covariance.advance(*step.T_previous_current, step.covariance);
  state_.prior.interrupt();
  return step;
}

/// Whether a guess has the motion of a pair that shows nothing, not too long after the last one that did.
bool VisualOdometry::canFollow(const StereoFeatures& features) const {
  if (!state_.map || !state_.followed || features.count() >= options_.motion.min_inliers) return false;
  const TrackingOptions& tracking = options_.tracking;
  return secondsSinceMap(features) <= (state_.followed->rotation_only ? tracking.max_gap : tracking.max_guessed);
}

VisualOdometry::Step VisualOdometry::predict(const StereoFeatures& features, double dt, const std::string& failure) {
  Step step;
  step.reason = failure + (features.report.status.empty() ? "" : "; " + features.report.status);
  const bool can_predict = state_.prior.velocity() && dt <= options_.tracking.max_gap &&
                           state_.predicted_pairs < options_.tracking.max_predicted_pairs;
  // The prior's translation over one pair is better than that around a standstill, which a gyro needs.
  if (canFollow(features) && !(can_predict && state_.followed->rotation_only)) {
    step.state = TrackingState::kDegraded;
    step.reason = "motion by the guess: " + step.reason;
    step.T_previous_current = state_.followed->motion;
    step.covariance = state_.followed->covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
    return step;
  }
  if (!can_predict) {
    breakStream();
    step.state = TrackingState::kLost;
    return step;
  }
  ++state_.predicted_pairs;
  step.state = TrackingState::kDegraded;
  step.reason = "motion predicted: " + step.reason;
  const ExpectedMotion predicted = state_.prior.predicted(dt);
  step.T_previous_current = predicted.motion;
  step.covariance = predicted.covariance;
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

OdometryResult VisualOdometry::report(const StereoFeatures& features, const MotionHypothesis& found,
                                      const Step& step) const {
  OdometryResult result;
  result.state = step.state;
  result.reason = step.reason;
  result.stamp = features.stamp;
  result.epoch = epoch_;
  result.dt = step.dt;
  result.distance = state_.distance;
  result.keyframe_id = state_.map && !state_.interrupted ? state_.map->lastKeyframeId() : 0;
  if (step.state == TrackingState::kTracking || step.state == TrackingState::kDegraded) {
    result.has_pose = true;
    result.T_origin_camera = state_.T_origin_camera;
    result.pose_covariance = state_.covariance.value();
    const double drift = state_.right_delay.drift();
    result.pose_covariance.topLeftCorner<3, 3>() += drift * drift * Eigen::Matrix3d::Identity();
    if (options_.planar.planar && state_.floor.isOnFloor())
      result.pose_covariance = floor()->constrained(state_.T_origin_camera, result.pose_covariance);
  }
  if (step.T_previous_current) {
    result.has_motion = true;
    result.T_previous_current = *step.T_previous_current;
    result.motion_covariance = step.covariance;
    result.correction = step.correction;
  }

  reportMatches(features, found, step, result);
  const RigCalibration::Vector sigma = state_.calibration.sigma();
  if (sigma.allFinite()) {
    result.disparity_offset = state_.calibration.calibration().value[0];
    result.disparity_bend = state_.calibration.calibration().value[1];
    result.disparity_offset_sigma = sigma[0];
    result.disparity_bend_sigma = sigma[1];
  }
  if (const auto delay = state_.right_delay.estimate())
    result.right_delay = delay->value, result.right_delay_sigma = delay->sigma;
  if (const auto readout = state_.readout.estimate())
    result.readout = readout->value, result.readout_sigma = readout->sigma;
  result.right_rotation = state_.right_rotation.rotation();
  result.right_rotation_sigma = state_.right_rotation.sigma();
  return result;
}

/// The matches, which of them are inliers, and what follows from these.
void VisualOdometry::reportMatches(const StereoFeatures& features, const MotionHypothesis& found, const Step& step,
                                   OdometryResult& result) const {
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
}

}  // namespace sdvo
