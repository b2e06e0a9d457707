#include "pair_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sdvo {

SearchTools::SearchTools(const VisualOdometryOptions& options)
    : motions(FeatureMatcherOptions(), options.motion, alignmentWith(options.noise)),
      places(FeatureMatcherOptions(), options.motion) {}

double largestDoubt(const TrackingOptions& tracking) {
  return logOdds(1.0 - tracking.probability);
}

PairSearch::PairSearch(const VisualOdometryOptions& options, const SearchTools& tools, const OdometryState& state,
                       const StereoFeatures& given, const std::optional<MotionGuess>& guess)
    : options_(options), tools_(tools), state_(state), given_(given), guess_(guess) {
  if (state.last_stamp) dt_ = state.secondsUntil(given.stamp);
  searchBy(given.camera);
  if (kind_ != kContinues || !state.lens || !state.lens->isLike(given.camera) || !movesFeatures(*state.lens)) return;
  // Either the lens moved, or camera_info changed without it: a fault of the driver, or a new calibration.
  const double by_given = logLikelihood();
  searchBy(*state.lens);
  const double ratio = (logLikelihood() - by_given) / state.rig.noise.shared();  // so many points err as one
  if (!(kUnsuspected + ratio > 0.0)) searchBy(given.camera);
}

/// Searches with pixels of this camera.
void PairSearch::searchBy(const StereoCamera& lens) {
  take(lens);
  if (!state_.map || !state_.map->continuedBy(taken()))
    kind_ = kNoMap;
  else if (state_.interrupted)
    kind_ = kAfterOutage;
  else if ((log_odds_of_frozen_ = findRepeated()) >= kCertain)
    kind_ = kFrozen;
  else
    kind_ = kContinues;
  compensate(Eigen::Vector3d::Zero());
  findRotated();
}

/// The features as the map's camera sees them, without those that repeat the previous pair's. A focusing lens changes
/// the camera with every pair, but the pixels of a map are of one camera.
void PairSearch::take(const StereoCamera& lens) {
  lens_ = lens;
  refocused_.reset(), new_part_.reset(), rotated_back_.reset(), synchronised_.reset();
  newest_.reset(), map_.reset();
  rotation_ = RotationHypothesis();
  if (lens != given_.camera) refocused_ = given_, refocused_->camera = lens;
  if (state_.camera && *state_.camera != lens && state_.camera->isLike(lens))
    refocused_ = whole().seenBy(*state_.camera);
  new_features_ = state_.images.newFeatures(whole(), state_.rig.noise.sameMotion(), expectedMotion(guess_));
  if (static_cast<int>(new_features_.size()) < given_.count()) new_part_ = whole().select(new_features_);
}

/// Whether the change from the camera before moves a feature by more than the noise of corners.
bool PairSearch::movesFeatures(const StereoCamera& before) const {
  if (before == given_.camera) return false;
  const StereoFeatures seen = given_.seenBy(before);
  for (int i = 0; i < seen.count(); ++i)
    if (std::hypot(seen.u[i] - given_.u[i], seen.v[i] - given_.v[i], seen.disparity[i] - given_.disparity[i]) >
        options_.noise.corner)
      return true;
  return false;
}

/// Of the motion that is found, by its inliers' aligned positions, up to a constant: half of each square, up to the
/// gate, which is what a wrong match costs. All counts half, for the map's points err as much as the pair's.
double PairSearch::logLikelihood() const {
  const StereoCamera& camera = features().camera;
  const NoiseOptions& noise = options_.noise;
  const double disparity_variance = std::pow(noise.disparity, 2) + std::pow(noise.common_disparity, 2);
  double explained = 0.0;
  for (std::size_t k = 0; k < found_.sightings.size(); ++k) {
    const LocalMap::Sighting& sighting = found_.sightings[k];
    const int reference = found_.matches[static_cast<std::size_t>(found_.motion.inliers[k])].reference;
    const Eigen::Vector3d point = found_.motion.T_current_reference * found_.view->points.positions[reference];
    const Eigen::Vector2d left = camera.project(point).head<2>();
    const double disparity =
        camera.disparity(point.z()) + scene_->calibration.disparityError(camera, left.x(), left.y());
    const double square = (sighting.measurement.head<2>() - left).squaredNorm() / std::pow(sighting.sigma, 2) +
                          std::pow(sighting.measurement.z() - disparity, 2) / disparity_variance;
    explained += std::max(noiseGate(3) - 0.5 * square, 0.0);
  }
  return 0.5 * explained;
}

/// Expected motion since the previous pair: the guess, else the prediction.
std::optional<Eigen::Isometry3d> PairSearch::expectedMotion(const std::optional<MotionGuess>& guess) const {
  if (guess) return motionBy(*guess, state_.prior, dt_);
  if (state_.interrupted || !state_.prior.velocity() || dt_ > options_.tracking.max_gap) return std::nullopt;
  return state_.prior.predicted(dt_).motion;
}

/// Log-odds that images repeat although the camera moved. The guess, or the last motion, implies whether it did. A
/// robot may stop from one pair to the next as far as the prior allows; unless images show noise, the first repeated
/// pair decides.
double PairSearch::findRepeated() const {
  const StereoFeatures& features = taken();
  const RepeatedImages& images = state_.images;
  if (!images.repeat(features)) return kUnsuspected;
  const auto moved = [&](const Eigen::Isometry3d& T_previous_current) {
    return RepeatedImages::shouldHaveMoved(features, state_.rig.noise.sameMotion(), T_previous_current);
  };
  // Another odometry knows.
  if (guess_ && !guess_->rotation_only) return moved(guess_->T_previous_current) ? kCertain : kUnsuspected;
  if (state_.frozen) return kCertain;  // it goes on
  // A gyro knows that the camera turned, but not that it stood.
  if (guess_ && moved(Eigen::Isometry3d(guess_->T_previous_current.linear()))) return kCertain;
  // Without a motion that images would show, the camera may stand.
  const auto prior = state_.prior.priorByConfirmed(*state_.last_stamp, dt_);
  const auto expected = expectedMotion(std::nullopt);
  if (!prior || !moved(expected.value_or(prior->motion))) return kUnsuspected;
  if (images.comeTwice()) return kCertain;
  const double old = images.logOddsOfOld(features.report.noise);
  // The pair before repeated, too, and was taken for a stop: the camera stands.
  if (images.inARow() > 0 && !(old > 0.0)) return kUnsuspected;
  const double stop = 0.5 * prior->normalisedSquare(Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  return std::min(old + std::min(stop, -std::log(kTailProbability)), kCertain);
}

/// Features as of a right camera that did not rotate, neither as is known nor by `new_rotation` (rad) beyond, and is
/// synchronous.
void PairSearch::compensate(const Eigen::Vector3d& new_rotation) {
  const Eigen::Vector3d rotation = state_.rig.rotation + new_rotation;
  rotated_back_.reset();
  if (!rotation.isZero()) rotated_back_ = rotatedBack(part(), rotation);
  const bool has_map = kind_ == kContinues || kind_ == kAfterOutage;
  const bool is_predicted = has_map && state_.prior.velocity() && dt_ <= options_.tracking.max_gap;
  if (is_predicted) synchronised_ = synchronised(*state_.prior.velocity());
  roll(is_predicted ? *state_.prior.velocity() : Vector6d::Zero());
}

/// The features at the time of the left image; none if no delay is known.
std::optional<StereoFeatures> PairSearch::synchronised(const Vector6d& velocity) const {
  const double known = state_.rig.calibration.delay();
  if (taken().right_delay + known == 0.0) return std::nullopt;
  return state_.rig.right_delay.synchronised(taken(), dt_, velocity, known);
}

/// Moves all rows to the stamp, by the velocity of the camera there.
void PairSearch::roll(const Vector6d& velocity) {
  if (!state_.shutter.isRolling()) return;
  rolled_ = RolledPair{inStep(), state_.shutter.readout(), velocity};
  global_ = RollingShutter::asGlobal(*rolled_);
}

/// Moves rows of the pair, and of the map's newest one, by the velocities that the pair's motion implies. False if they
/// are moved so already.
bool PairSearch::rollAgain() {
  const RollingShutter& shutter = state_.shutter;
  const auto changes = [&](RolledPair& rolled, const Vector6d& velocity) {
    if (shutter.isNegligible(rolled.features.camera, velocity - rolled.velocity)) return false;
    rolled.velocity = velocity;
    return true;
  };
  RolledPair& now = *rolled_;
  now.forgetMotion();
  now.rate_by_rows = shutter.rateByRows(now, found_);
  bool has_changed = false;
  if (kind_ == kContinues) {
    const Eigen::Isometry3d motion = found_.motion.T_current_reference.inverse();
    now.dt = state_.prior.interval(state_.map->secondsUntil(now.features), motion);
    now.mean_velocity = logSE3(motion) / now.dt;
    if (state_.newest && state_.newest->features.stamp == state_.map->newestStamp()) {
      const RolledPair& newest = *state_.newest;
      now.mean_velocity_before = newest.mean_velocity;
      if (!newest_) newest_ = newest;
      if (changes(*newest_, shutter.velocityBetween(newest, *now.mean_velocity))) {
        has_changed = true;
        map_ = state_.map;
        map_->moveNewest(shutter.asGlobal(newest), shutter.asGlobal(*newest_), state_.rig.calibration.calibration());
      }
    }
  }
  if (changes(now, shutter.velocityAt(now))) {
    has_changed = true;
    global_ = shutter.asGlobal(now);
  }
  return has_changed;
}

/// Searches in the map, after an outage also in the earlier map and the fallback map. Returns the camera's velocity;
/// zero if nothing is found.
Vector6d PairSearch::find() {
  scene_.reset();
  if (kind_ == kContinues) scene_.emplace(sceneOf(map_ ? *map_ : *state_.map, dt_, guess_));
  if (kind_ == kAfterOutage)
    if (auto place = reacquired()) scene_.emplace(std::move(*place));
  found_ = scene_ ? tools_.motions.find(*scene_, largestDoubt(options_.tracking)) : MotionHypothesis();
  if (!found_.motion.success) return Vector6d::Zero();
  const Eigen::Isometry3d motion = found_.motion.T_current_reference.inverse();
  return logSE3(motion) / state_.prior.interval(scene_->map.secondsUntil(features()), motion);
}

/// If the camera turns otherwise than expected, the delay is compensated again.
Vector6d PairSearch::findSynchronised() {
  constexpr double kNegligible = 0.02;  // px (chosen): a fifth of a disparity's noise
  const Vector6d velocity = find();
  if (kind_ != kContinues || !synchronised_ || !found_.motion.success) return velocity;
  const double delay = taken().right_delay + state_.rig.calibration.delay();
  const double unexpected = (velocity - *state_.prior.velocity()).tail<3>().norm();
  if (std::abs(delay) * given_.camera.fx * unexpected < kNegligible) return velocity;
  synchronised_ = synchronised(velocity);
  roll(velocity);
  return find();
}

/// The same with rows that are moved by the velocity that is found.
Vector6d PairSearch::findGlobal() {
  constexpr int kPasses = 3;  // at most; each leaves some hundredths of the velocity's error
  Vector6d velocity = findSynchronised();
  for (int pass = 0; pass < kPasses && rolled_ && found_.motion.success && rollAgain(); ++pass) velocity = find();
  return velocity;
}

/// New rotation of the right camera; features are rotated back by its part `compensated`, rad, already.
RotationHypothesis PairSearch::rotationBeyond(const Eigen::Vector3d& compensated) {
  const Vector6d velocity = findGlobal();
  const Eigen::Vector3d turn = dt_ * velocity.tail<3>();
  const Eigen::Vector3d before = dt_ * state_.prior.velocity().value_or(Vector6d::Zero()).tail<3>();
  const Eigen::Matrix3d turns = turn * turn.transpose() + before * before.transpose();
  return state_.rig.rotationHypothesis(features(), found_, compensated, turns, dt_);
}

/// If the right camera seems to have rotated, features are compensated again and the search is repeated.
void PairSearch::findRotated() {
  rotation_ = rotationBeyond(Eigen::Vector3d::Zero());
  if (kind_ == kContinues && scene_->T_current_reference && !found_.isOfMajority()) tryYaw();
  if (!(rotation_.log_odds > 0.0)) return;
  compensate(rotation_.value);
  findGlobal();
}

/// Without a motion of most matches, a yaw of the right camera is tried: after a knock beyond the matches' noise no
/// motion explains both views, but the left one alone may be explained. It is kept if more matches agree.
void PairSearch::tryYaw() {
  const int inliers = found_.agreement.inliers;
  const Eigen::Vector3d yaw = yawByDisparities(given_.camera, found_.correspondences, *scene_->T_current_reference);
  compensate(yaw);
  const RotationHypothesis with_yaw = rotationBeyond(yaw);
  if (found_.motion.success && found_.agreement.inliers > inliers && with_yaw.log_odds > 0.0) {
    rotation_ = with_yaw;
  } else {
    compensate(rotation_.log_odds > 0.0 ? rotation_.value : Eigen::Vector3d::Zero());
    findGlobal();
  }
}

/// The map, the pair, and the expected motion between them: that of predicted pairs since the reference, then the
/// velocity or the guess.
MotionScene PairSearch::sceneOf(const LocalMap& map, double dt, const std::optional<MotionGuess>& guess) const {
  const MotionPrior& prior = state_.prior;
  MotionScene scene{map,
                    state_.rig.calibration.calibration(),
                    features(),
                    {},
                    {},
                    {},
                    state_.doubt.lasts(),
                    state_.doubt.logOdds() > largestDoubt(options_.tracking),
                    options_.tracking.doubtful_deviation,
                    state_.rig.noise};
  const Eigen::Isometry3d T_reference_previous = map.newestPose() * state_.T_origin_camera;
  const double since = map.secondsUntil(features());
  if (const auto confirmed = prior.priorByConfirmed(map.newestStamp(), since)) scene.prior.push_back(*confirmed);
  if (prior.velocity() && dt <= options_.tracking.max_gap)
    scene.T_current_reference = (T_reference_previous * prior.predicted(dt).motion).inverse();
  if (guess) {
    scene.guess = (T_reference_previous * motionBy(*guess, prior, dt)).inverse();
    if (!scene.prior.empty()) scene.prior.push_back(prior.around(scene.guess->inverse(), since));
  }
  return scene;
}

/// Where the pair is in the map from before the outage, in the earlier map, else in the fallback map. The camera's
/// motion meanwhile is unknown.
std::optional<MotionScene> PairSearch::reacquired() const {
  std::optional<MotionScene> scene;
  for (const LocalMap* map : {&*state_.map, state_.earlier ? &state_.earlier->map : nullptr}) {
    if (!map || !map->continuedBy(features())) continue;
    const auto place = tools_.places.find(*map, features(), state_.rig.calibration.calibration());
    const double since = map->secondsUntil(features());
    if (!place || !state_.prior.tooFast(place->T_current_newest.inverse(), Matrix6d::Zero(), since).empty()) continue;
    scene.emplace(sceneOf(*map, 0.0, std::nullopt));
    scene->place = choosePlace(*place, scene->prior);
    scene->T_current_reference = scene->place->T_current_newest;
    scene->prior.clear();
    return scene;
  }
  if (state_.fallback_map) scene.emplace(sceneOf(*state_.fallback_map, 0.0, std::nullopt));
  return scene;
}

}  // namespace sdvo
