#include "pair_search.hpp"

#include <algorithm>
#include <cmath>

namespace sdvo {
namespace {

/// Makes a SearchedPair.
class PairSearch {
 public:
  PairSearch(const VisualOdometryOptions& options, const OdometryTools& tools, const OdometryState& state,
             const StereoFeatures& given, const std::optional<MotionGuess>& guess, SearchedPair& pair)
      : options_(options), tools_(tools), state_(state), given_(given), guess_(guess), pair_(pair) {}

  void run() {
    if (state_.last_stamp) pair_.dt = state_.secondsUntil(given_.stamp);
    searchWith(given_.camera);
    const std::optional<StereoCamera>& before = state_.pair_camera;
    if (pair_.kind != SearchedPair::kContinues || !before || !before->isLike(given_.camera) || !movesFeatures(*before))
      return;
    // Either the lens moved, or camera_info changed without it: a fault of the driver, or a new calibration.
    const double by_given = logLikelihood();
    searchWith(*before);
    const double ratio = (logLikelihood() - by_given) / state_.rig.noise.shared();  // so many points err as one
    pair_.refutes_camera_info = kUnsuspected + ratio > 0.0;
    if (!pair_.refutes_camera_info) searchWith(given_.camera);
  }

 private:
  /// Searches with pixels of this camera.
  void searchWith(const StereoCamera& camera) {
    take(camera);
    if (!state_.map || !state_.map->continuedBy(part_))
      pair_.kind = SearchedPair::kNoMap;
    else if (state_.interrupted)
      pair_.kind = SearchedPair::kInterrupted;
    else if ((pair_.log_odds_of_frozen = logOddsOfFrozen()) >= kCertain)
      pair_.kind = SearchedPair::kFrozen;
    else
      pair_.kind = SearchedPair::kContinues;
    pair_.rotation = searchRotatedBack(Eigen::Vector3d::Zero());
    const bool has_majority = pair_.found.isOfMajority();
    if (pair_.kind == SearchedPair::kContinues && pair_.scene->T_current_reference && !has_majority) tryYaw();
    if (!(pair_.rotation.log_odds > 0.0)) return;
    searchRotatedBack(pair_.rotation.value);  // the motion alone is found anew
  }

  /// The features as the map's camera sees them, without those that repeat the previous pair's. A focusing lens changes
  /// the camera with every pair, but the pixels of a map are of one camera.
  void take(const StereoCamera& camera) {
    pair_.camera = camera;
    pair_.unrolled_map.reset(), newest_.reset();
    pair_.whole = given_;
    pair_.whole.camera = camera;
    if (state_.map_camera && *state_.map_camera != camera && state_.map_camera->isLike(camera))
      pair_.whole = pair_.whole.seenBy(*state_.map_camera);
    pair_.given_indices = state_.images.newFeatures(pair_.whole, state_.rig.noise.sameMotion(), expectedMotion(guess_));
    pair_.repeats_a_part = static_cast<int>(pair_.given_indices.size()) < given_.count();
    part_ = pair_.repeats_a_part ? pair_.whole.select(pair_.given_indices) : pair_.whole;
  }

  /// Whether the change from the camera before moves a feature by more than the noise of corners.
  bool movesFeatures(const StereoCamera& before) const {
    if (before == given_.camera) return false;
    const StereoFeatures seen = given_.seenBy(before);
    for (int i = 0; i < seen.count(); ++i)
      if (std::hypot(seen.u[i] - given_.u[i], seen.v[i] - given_.v[i], seen.disparity[i] - given_.disparity[i]) >
          options_.noise.corner)
        return true;
    return false;
  }

  /// Of the motion that is found, by its inliers' aligned positions, up to a constant: half of each square, up to the
  /// gate, which is what a wrong match costs. All counts half, because the map's point errs as much as the pair's and
  /// the squares are twice as large.
  double logLikelihood() const {
    const StereoCamera& camera = pair_.features.camera;
    const NoiseOptions& noise = options_.noise;
    const MotionHypothesis& found = pair_.found;
    const double disparity_variance = std::pow(noise.disparity, 2) + std::pow(noise.common_disparity, 2);
    double explained = 0.0;
    for (std::size_t k = 0; k < found.sightings.size(); ++k) {
      const LocalMap::Sighting& sighting = found.sightings[k];
      const int reference = found.matches[found.motion.inliers[k]].reference;
      const Eigen::Vector3d point = found.motion.T_current_reference * found.view->points.positions[reference];
      const Eigen::Vector2d left = camera.project(point).head<2>();
      const double disparity =
          camera.disparity(point.z()) + pair_.scene->calibration.disparityError(camera, left.x(), left.y());
      const double square = (sighting.measurement.head<2>() - left).squaredNorm() / std::pow(sighting.sigma, 2) +
                            std::pow(sighting.measurement.z() - disparity, 2) / disparity_variance;
      explained += std::max(noiseGate(3) - 0.5 * square, 0.0);
    }
    return 0.5 * explained;
  }

  /// Expected motion since the previous pair: the guess, else the prediction.
  std::optional<Eigen::Isometry3d> expectedMotion(const std::optional<MotionGuess>& guess) const {
    if (guess) return motionBy(*guess, state_.prior, pair_.dt);
    if (state_.interrupted || !state_.prior.velocity() || pair_.dt > options_.tracking.max_gap) return std::nullopt;
    return state_.prior.predicted(pair_.dt).motion;
  }

  /// The guess, or the last motion, implies whether the camera moved. A robot may stop from one pair to the next as far
  /// as the prior allows; unless images show noise, the first repeated pair decides.
  double logOddsOfFrozen() const {
    const RepeatedImages& images = state_.images;
    if (!images.repeat(part_)) return kUnsuspected;
    const auto moved = [&](const Eigen::Isometry3d& T_previous_current) {
      return RepeatedImages::shouldHaveMoved(part_, state_.rig.noise.sameMotion(), T_previous_current);
    };
    // Another odometry knows.
    if (guess_ && !guess_->rotation_only) return moved(guess_->T_previous_current) ? kCertain : kUnsuspected;
    if (state_.frozen) return kCertain;  // it goes on
    // A gyro knows that the camera turned, but not that it stood.
    if (guess_ && moved(Eigen::Isometry3d(guess_->T_previous_current.linear()))) return kCertain;
    // Without a motion that images would show, the camera may stand.
    const auto prior = state_.prior.priorByConfirmed(*state_.last_stamp, pair_.dt);
    const auto expected = expectedMotion(std::nullopt);
    if (!prior || !moved(expected.value_or(prior->motion))) return kUnsuspected;
    if (images.comeTwice()) return kCertain;
    const double old = images.logOddsOfOld(part_.report.noise);
    // The pair before repeated, too, and was taken for a stop: the camera stands.
    if (images.inARow() > 0 && !(old > 0.0)) return kUnsuspected;
    const double stop = 0.5 * prior->normalisedSquare(Eigen::Isometry3d::Identity(), Matrix6d::Zero());
    return std::min(old + std::min(stop, -std::log(kTailProbability)), kCertain);
  }

  /// Takes the known rotation of the right camera and `compensated` (rad) out of the features, then searches the
  /// motion: sets features, scene and found of the pair. Each velocity that is found compensates the delay and the rows
  /// better. Returns the new rotation that then results, `compensated` included.
  RotationHypothesis searchRotatedBack(const Eigen::Vector3d& compensated) {
    constexpr int kPasses = 3;  // at most, for rows; each leaves some hundredths of the velocity's error
    const Eigen::Vector3d rotation = state_.rig.rotation + compensated;
    pair_.rotated_back = rotation.isZero() ? part_ : rotatedBack(part_, rotation);
    const std::optional<Vector6d> predicted = predictedVelocity();
    moveToStamp(predicted);
    Vector6d velocity = find();
    if (predicted && isMisplacedByDelay(velocity - *predicted)) {
      moveToStamp(velocity);
      velocity = find();
    }
    for (int pass = 0; pass < kPasses && pair_.rolled && pair_.found.motion.success && moveRows(); ++pass)
      velocity = find();
    const Eigen::Vector3d turn = pair_.dt * velocity.tail<3>();
    const Eigen::Vector3d before = pair_.dt * state_.prior.velocity().value_or(Vector6d::Zero()).tail<3>();
    const Eigen::Matrix3d turns = turn * turn.transpose() + before * before.transpose();
    return state_.rig.rotationHypothesis(pair_.features, pair_.found, compensated, turns, pair_.dt);
  }

  std::optional<Vector6d> predictedVelocity() const {
    const bool has_map = pair_.kind == SearchedPair::kContinues || pair_.kind == SearchedPair::kInterrupted;
    return has_map && pair_.dt <= options_.tracking.max_gap ? state_.prior.velocity() : std::nullopt;
  }

  /// Whether the right view's delay, compensated by a velocity with this error, leaves features misplaced.
  bool isMisplacedByDelay(const Vector6d& error) const {
    constexpr double kNegligible = 0.02;  // px (chosen): a fifth of a disparity's noise
    if (pair_.kind != SearchedPair::kContinues || !pair_.found.motion.success) return false;
    const double delay = pair_.rotated_back.right_delay + state_.rig.calibration.delay();
    return std::abs(delay) * given_.camera.fx * error.tail<3>().norm() >= kNegligible;
  }

  /// Moves the right view to the time of the left one, if the velocity is known, and all rows to the stamp.
  void moveToStamp(const std::optional<Vector6d>& velocity) {
    const double known = state_.rig.calibration.delay();
    pair_.features = pair_.rotated_back;
    if (velocity && pair_.rotated_back.right_delay + known != 0.0)
      pair_.features = state_.rig.right_delay.synchronised(pair_.rotated_back, pair_.dt, *velocity, known);
    if (!state_.shutter.isRolling()) return;
    pair_.rolled = RolledPair{pair_.features, state_.shutter.readout(), velocity.value_or(Vector6d::Zero())};
    pair_.features = RollingShutter::asGlobal(*pair_.rolled);
  }

  /// Moves rows of the pair, and of the map's newest one, by the velocities that the pair's motion implies. False if
  /// they are moved so already.
  bool moveRows() {
    const RollingShutter& shutter = state_.shutter;
    const auto changes = [&](RolledPair& rolled, const Vector6d& velocity) {
      if (shutter.isNegligible(rolled.features.camera, velocity - rolled.velocity)) return false;
      rolled.velocity = velocity;
      return true;
    };
    RolledPair& now = *pair_.rolled;
    now.forgetMotion();
    now.rate_by_rows = shutter.rateByRows(now, pair_.found);
    bool has_changed = false;
    if (pair_.kind == SearchedPair::kContinues) {
      const Eigen::Isometry3d motion = pair_.found.motion.T_current_reference.inverse();
      now.dt = state_.prior.interval(state_.map->secondsUntil(now.features), motion);
      now.mean_velocity = logSE3(motion) / now.dt;
      if (state_.newest_rolled && state_.newest_rolled->features.stamp == state_.map->newestStamp()) {
        const RolledPair& newest = *state_.newest_rolled;
        now.mean_velocity_before = newest.mean_velocity;
        if (!newest_) newest_ = newest;
        if (changes(*newest_, shutter.velocityBetween(newest, *now.mean_velocity))) {
          has_changed = true;
          pair_.unrolled_map = state_.map;
          pair_.unrolled_map->moveNewest(shutter.asGlobal(newest), shutter.asGlobal(*newest_),
                                         state_.rig.calibration.calibration());
        }
      }
    }
    if (changes(now, shutter.velocityAt(now))) {
      has_changed = true;
      pair_.features = shutter.asGlobal(now);
    }
    return has_changed;
  }

  /// Searches in the map, after an outage also in the earlier map and the fallback map. Returns the camera's velocity;
  /// zero if nothing is found.
  Vector6d find() {
    pair_.scene.reset();
    pair_.in_earlier_map = pair_.in_fallback_map = false;
    if (pair_.kind == SearchedPair::kContinues)
      pair_.scene.emplace(sceneOf(pair_.unrolled_map ? *pair_.unrolled_map : *state_.map, guess_));
    if (pair_.kind == SearchedPair::kInterrupted) findPlace();
    pair_.found = pair_.scene ? tools_.motions.find(*pair_.scene, largestDoubt(options_.tracking)) : MotionHypothesis();
    if (!pair_.found.motion.success) return Vector6d::Zero();
    const Eigen::Isometry3d motion = pair_.found.motion.T_current_reference.inverse();
    return logSE3(motion) / state_.prior.interval(pair_.sinceReference(), motion);
  }

  /// Without a motion of most matches, a yaw of the right camera is tried: after a knock beyond the matches' noise no
  /// motion explains both views, but the left one alone may be explained. It is kept if more matches agree.
  void tryYaw() {
    const int inliers = pair_.found.agreement.inliers;
    const Eigen::Vector3d yaw =
        yawByDisparities(given_.camera, pair_.found.correspondences, *pair_.scene->T_current_reference);
    const RotationHypothesis with_yaw = searchRotatedBack(yaw);
    if (pair_.found.motion.success && pair_.found.agreement.inliers > inliers && with_yaw.log_odds > 0.0)
      pair_.rotation = with_yaw;
    // Else the trial is undone; where the first rotation is likely, searchWith() searches with that next.
    else if (!(pair_.rotation.log_odds > 0.0))
      searchRotatedBack(Eigen::Vector3d::Zero());
  }

  /// The map, the pair, and the expected motion between them: that of predicted pairs since the reference, then the
  /// velocity or the guess.
  MotionScene sceneOf(const LocalMap& map, const std::optional<MotionGuess>& guess) const {
    const MotionPrior& prior = state_.prior;
    const bool searches_wide = state_.doubt.logOdds() > largestDoubt(options_.tracking);
    MotionScene scene{map,           state_.rig.calibration.calibration(), pair_.features,  state_.doubt.lasts(),
                      searches_wide, options_.tracking.doubtful_deviation, state_.rig.noise};
    const Eigen::Isometry3d T_reference_previous = map.newestPose() * state_.T_origin_camera;
    const double since = map.secondsUntil(pair_.features);
    if (const auto confirmed = prior.priorByConfirmed(map.newestStamp(), since)) scene.prior.push_back(*confirmed);
    if (prior.velocity() && pair_.dt <= options_.tracking.max_gap)
      scene.T_current_reference = (T_reference_previous * prior.predicted(pair_.dt).motion).inverse();
    if (guess) {
      scene.guess = (T_reference_previous * motionBy(*guess, prior, pair_.dt)).inverse();
      if (!scene.prior.empty()) scene.prior.push_back(prior.around(scene.guess->inverse(), since));
    }
    return scene;
  }

  /// Looks for the pair in the map from before the outage, in the earlier map, else in the fallback map. The camera's
  /// motion meanwhile is unknown.
  void findPlace() {
    for (const LocalMap* map : {&*state_.map, state_.earlier ? &state_.earlier->map : nullptr}) {
      if (!map || !map->continuedBy(pair_.features)) continue;
      const auto place = tools_.places.find(*map, pair_.features, state_.rig.calibration.calibration());
      const double since = map->secondsUntil(pair_.features);
      if (!place || !state_.prior.tooFast(place->T_current_newest.inverse(), Matrix6d::Zero(), since).empty()) continue;
      // The velocity is from before the outage, and the place has weighed the prior: neither predicts the motion.
      MotionScene& scene = pair_.scene.emplace(sceneOf(*map, std::nullopt));
      scene.place = choosePlace(*place, scene.prior);
      scene.T_current_reference = scene.place->T_current_newest;
      scene.prior.clear();
      pair_.in_earlier_map = map != &*state_.map;
      return;
    }
    if (!state_.fallback_map) return;
    pair_.scene.emplace(sceneOf(*state_.fallback_map, std::nullopt));
    pair_.in_fallback_map = true;
  }

  const VisualOdometryOptions& options_;
  const OdometryTools& tools_;
  const OdometryState& state_;
  const StereoFeatures& given_;
  const std::optional<MotionGuess>& guess_;
  SearchedPair& pair_;
  StereoFeatures part_;               // in the map's pixels, without repeated rows
  std::optional<RolledPair> newest_;  // of the map, with its velocity since the pair's motion is known
};

}  // namespace

double largestDoubt(const TrackingOptions& tracking) {
  return logOdds(1.0 - tracking.probability);
}

SearchedPair::SearchedPair(const VisualOdometryOptions& options, const OdometryTools& tools, const OdometryState& state,
                           const StereoFeatures& given, const std::optional<MotionGuess>& guess) {
  PairSearch(options, tools, state, given, guess, *this).run();
}

}  // namespace sdvo
