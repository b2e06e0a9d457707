#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "../belief/belief.hpp"
#include "../belief/motion_search.hpp"
#include "../common/stopwatch.hpp"
#include "../map/reacquisition.hpp"
#include "odometry_state.hpp"

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
                    RowDelay::cellOf(features.u[current], features.v[current], camera.width, camera.height)});
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

  /// A pair as it is searched: in the map's camera, without repeated rows, with the right image rotated back and
  /// synchronous, all rows of one moment.
  struct Pair {
    const StereoFeatures& given;
    std::optional<StereoFeatures> refocused{}, new_part{}, rotated_back{}, synchronised{};
    std::optional<RolledPair> rolled{};      ///< only with a rolling shutter, as the next three
    std::optional<StereoFeatures> global{};  ///< rows moved to the stamp
    std::optional<RolledPair> newest{};      ///< of the map, with its velocity since the pair's motion is known
    std::optional<LocalMap> map{};           ///< with this velocity
    std::vector<int> new_features{};
    double dt = 0.0;               ///< since the previous pair, s
    double frozen = kUnsuspected;  ///< log-odds that its images repeat although the camera moved
    /// Without a map of its camera; after an outage; with repeated images; after a pose.
    enum { kFirst, kSought, kFrozen, kFollowed } is = kFirst;
    ShownRotation rotation{};  ///< of the right camera beyond the known one

    const StereoFeatures& whole() const { return refocused ? *refocused : given; }
    const StereoFeatures& part() const { return new_part ? *new_part : whole(); }
    const StereoFeatures& taken() const { return rotated_back ? *rotated_back : part(); }
    const StereoFeatures& inStep() const { return synchronised ? *synchronised : taken(); }
    const StereoFeatures& features() const { return global ? *global : inStep(); }
  };

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

  void refuse(const StereoFeatures& features) const;
  OdometryResult sound(OdometryResult result);
  Pair prepared(const StereoFeatures& given, const std::optional<MotionGuess>& guess) const;
  void compensate(Pair& pair) const;
  void roll(Pair& pair, const Vector6d& velocity) const;
  bool rollAgain(Pair& pair, const MotionHypothesis& found) const;
  void rememberRolled(Pair& pair, const MotionHypothesis& found, Step& step);
  void search(Pair& pair, const std::optional<MotionGuess>& guess, std::optional<MotionScene>& scene,
              MotionHypothesis& found) const;
  std::optional<Eigen::Isometry3d> expectedMotion(double dt, const std::optional<MotionGuess>& guess) const;
  double logOddsOfFrozen(const StereoFeatures& features, double dt, const std::optional<MotionGuess>& guess) const;
  std::optional<StereoFeatures> synchronised(const StereoFeatures& taken, double dt, const Vector6d& velocity) const;
  MotionScene sceneOf(const LocalMap& map, const StereoFeatures& features, double dt,
                      const std::optional<MotionGuess>& guess) const;
  std::optional<MotionScene> reacquire(const StereoFeatures& features) const;
  double largestDoubt() const;
  std::optional<Floor> floor() const;

  void begin(const Pair& pair, const std::optional<MotionGuess>& guess);
  std::optional<MeasuredPair> measuredPair(const Pair& pair, const MotionHypothesis& found) const;
  std::vector<Evidence> evidenceAgainst(const Pair& pair, const MotionHypothesis& found,
                                        const std::optional<MeasuredPair>& measured);
  Step extendMap(const StereoFeatures& features, const MotionScene& scene, MotionHypothesis& found, double dt,
                 const std::vector<Evidence>& evidence);
  Candidate adjustBeyondDoubt(const StereoFeatures& features, const MotionScene& scene, MotionHypothesis& found);
  Candidate adjust(const StereoFeatures& features, const LocalMap& before, const MotionHypothesis& found,
                   bool may_recall);
  void commit(const Candidate& candidate, const Belief& belief);
  Step measure(const MotionHypothesis& found, const Candidate& candidate);
  void widen(const MotionScene& scene, const MotionHypothesis& found, const Belief& belief, Step& step);
  std::string doubtWords(const MotionScene& scene, const MotionHypothesis& found, const Candidate& candidate,
                         const Belief& belief) const;
  bool isDoubtful(const Belief& belief) const;
  void finish(const Pair& pair, Step& step);

  VisualOdometryOptions options_;
  Eigen::Isometry3d T_base_camera_;
  MotionSearch search_;
  Reacquisition reacquisition_;
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
      search_(FeatureMatcherOptions(), options_.motion, alignmentWith(options_.noise)),
      reacquisition_(FeatureMatcherOptions(), options_.motion),
      revisit_(FeatureMatcherOptions(), options_.motion, alignmentWith(options_.noise)),
      optimizer_(windowWith(options_.noise)),
      state_(options_, 0) {}

void VisualOdometry::Impl::configure(const VisualOdometryOptions& options) {
  options_ = checked(options).withOneNoise();
  search_ = MotionSearch(FeatureMatcherOptions(), options_.motion, alignmentWith(options_.noise));
  reacquisition_ = Reacquisition(FeatureMatcherOptions(), options_.motion);
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
  state_.covariance.advance(T_before_now, Matrix6d::Zero());
}

void VisualOdometry::Impl::takePose(const Matrix6d& covariance) {
  OdometryResult given;
  given.has_pose = true, given.pose_covariance = covariance;
  if (const std::string defect = given.defect(); !defect.empty()) throw std::invalid_argument(defect);
  state_.covariance.assume(covariance);
  state_.left.reset();  // its poses are from before
  ++state_.epoch;
  if (!state_.interrupted) return;
  state_.map.reset();
  state_.started = false;
}

OdometryResult VisualOdometry::Impl::update(const StereoFeatures& given, const std::optional<MotionGuess>& guess) {
  refuse(given);
  if (guess) guess->check();
  Pair pair = prepared(given, guess);
  std::optional<MotionScene> scene;
  MotionHypothesis found;
  search(pair, guess, scene, found);
  const StereoFeatures& features = pair.features();

  // The state has not changed so far, and from here on no input is rejected.
  Stopwatch stopwatch;
  begin(pair, guess);
  const std::optional<MeasuredPair> measured = measuredPair(pair, found);
  const std::vector<Evidence> evidence = evidenceAgainst(pair, found, measured);
  Step step;
  if (found.motion.success) {
    step = extendMap(features, *scene, found, pair.dt, evidence);
  } else {
    state_.doubt.raise(evidence);
    if (pair.is == Pair::kFrozen) step = holdPose(pair.dt, state_);
    if (pair.is == Pair::kFollowed) step = predictMotion(options_, features, pair.dt, found.motion.reason, state_);
    if (pair.is == Pair::kFirst || pair.is == Pair::kSought) step = startMap(options_, features, state_);
  }
  state_.rig.learn(features, measured ? &*measured : nullptr, found, pair.rotation,
                   step.state == TrackingState::kTracking && scene);
  finish(pair, step);
  rememberRolled(pair, found, step);
  step.time = stopwatch.lap();
  return sound(state_.report(features, pair.new_features, found, step, floor()));
}

/// The only way out of update(): no result leaves with a number that is not finite or a covariance that is none.
OdometryResult VisualOdometry::Impl::sound(OdometryResult result) {
  const std::string defect = result.defect();
  if (defect.empty()) {
    if (result.has_pose) state_.sound = result;
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

/// Prepares a pair for the search of its motion.
VisualOdometry::Impl::Pair VisualOdometry::Impl::prepared(const StereoFeatures& given,
                                                          const std::optional<MotionGuess>& guess) const {
  Pair pair{given};
  // A focusing lens changes the camera with every pair, but the pixels of a map are of one camera.
  if (state_.camera && *state_.camera != given.camera && state_.camera->isLike(given.camera))
    pair.refocused = given.seenBy(*state_.camera);
  if (state_.last_stamp) pair.dt = static_cast<double>(given.stamp - *state_.last_stamp) * 1e-9;
  const std::optional<Eigen::Isometry3d> expected = expectedMotion(pair.dt, guess);
  pair.new_features = state_.images.newFeatures(pair.whole(), state_.rig.noise.sameMotion(), expected);
  if (static_cast<int>(pair.new_features.size()) < given.count())
    pair.new_part = pair.whole().select(pair.new_features);
  const StereoFeatures& taken = pair.taken();
  if (!state_.map || !state_.map->continuedBy(taken))
    pair.is = Pair::kFirst;
  else if (state_.interrupted)
    pair.is = Pair::kSought;
  else if ((pair.frozen = logOddsOfFrozen(taken, pair.dt, guess)) >= kCertain)
    pair.is = Pair::kFrozen;
  else
    pair.is = Pair::kFollowed;
  compensate(pair);
  return pair;
}

/// Features as of a right camera that did not rotate and is synchronous.
void VisualOdometry::Impl::compensate(Pair& pair) const {
  const LearntRig& rig = state_.rig;
  const bool is_new = pair.rotation.log_odds > 0.0;
  const Eigen::Vector3d rotation = is_new ? Eigen::Vector3d(rig.rotation + pair.rotation.value) : rig.rotation;
  pair.rotated_back.reset();
  if (!rotation.isZero()) pair.rotated_back = rotatedBack(pair.part(), rotation);
  const bool has_map = pair.is == Pair::kFollowed || pair.is == Pair::kSought;
  const bool is_predicted = has_map && state_.prior.velocity() && pair.dt <= options_.tracking.max_gap;
  if (is_predicted) pair.synchronised = synchronised(pair.taken(), pair.dt, *state_.prior.velocity());
  roll(pair, is_predicted ? *state_.prior.velocity() : Vector6d::Zero());
}

/// Moves all rows to the stamp, by the velocity of the camera there.
void VisualOdometry::Impl::roll(Pair& pair, const Vector6d& velocity) const {
  if (!state_.shutter.isRolling()) return;
  pair.rolled = RolledPair{pair.inStep(), velocity};
  pair.global = state_.shutter.asGlobal(*pair.rolled);
}

/// Moves rows of the pair, and of the map's newest one, by the velocities that the pair's motion implies. False if they
/// are moved so already.
bool VisualOdometry::Impl::rollAgain(Pair& pair, const MotionHypothesis& found) const {
  const RollingShutter& shutter = state_.shutter;
  const auto changes = [&](RolledPair& rolled, const Vector6d& velocity) {
    if (shutter.isNegligible(rolled.features.camera, velocity - rolled.velocity)) return false;
    rolled.velocity = velocity;
    return true;
  };
  RolledPair& now = *pair.rolled;
  now.forgetMotion();
  now.rate_by_rows = shutter.rateByRows(now, found);
  bool has_changed = false;
  if (pair.is == Pair::kFollowed) {
    const Eigen::Isometry3d motion = found.motion.T_current_reference.inverse();
    now.dt = state_.prior.interval(state_.map->secondsUntil(now.features), motion);
    now.mean = logSE3(motion) / now.dt;
    if (state_.newest && state_.newest->features.stamp == state_.map->newestStamp()) {
      const RolledPair& newest = *state_.newest;
      now.mean_before = newest.mean;
      if (!pair.newest) pair.newest = newest;
      if (changes(*pair.newest, shutter.velocityBetween(newest, *now.mean))) {
        has_changed = true;
        pair.map = state_.map;
        pair.map->moveNewest(shutter.asGlobal(newest), shutter.asGlobal(*pair.newest),
                             state_.rig.calibration.calibration());
      }
    }
  }
  if (changes(now, shutter.velocityAt(now))) {
    has_changed = true;
    pair.global = shutter.asGlobal(now);
  }
  return has_changed;
}

/// Widens covariances by the error of the pair's velocity, and keeps the pair until the next motion is known.
void VisualOdometry::Impl::rememberRolled(Pair& pair, const MotionHypothesis& found, Step& step) {
  const auto ends_with_it = [&](const std::optional<LocalMap>& map) {
    return map && map->newestStamp() == pair.given.stamp;
  };
  if (!pair.rolled || (!ends_with_it(state_.map) && !ends_with_it(state_.seed))) return;
  RolledPair& rolled = *pair.rolled;
  if (!found.motion.success || !step.T_previous_current) {
    rolled.forgetMotion();
  } else {
    const Matrix6d moment = state_.shutter.momentOf(rolled);
    step.covariance += moment;
    state_.covariance.doubt(moment, moment);
  }
  if (state_.newest && rolled.mean) state_.shutter.learn(*state_.newest, *rolled.mean);
  state_.newest = std::move(pair.rolled);
}

/// Searches the pair's motion in the map, after an outage also in the seed. If the camera turns otherwise than
/// expected, or the right one seems to have rotated, features are compensated again and the search is repeated. Without
/// a motion of most matches, a yaw of the right camera is tried; it is kept if more matches agree.
void VisualOdometry::Impl::search(Pair& pair, const std::optional<MotionGuess>& guess,
                                  std::optional<MotionScene>& scene, MotionHypothesis& found) const {
  const auto find = [&] {
    scene.reset();
    if (pair.is == Pair::kFollowed)
      scene.emplace(sceneOf(pair.map ? *pair.map : *state_.map, pair.features(), pair.dt, guess));
    if (pair.is == Pair::kSought)
      if (auto place = reacquire(pair.features())) scene.emplace(std::move(*place));
    found = scene ? search_.find(*scene, largestDoubt()) : MotionHypothesis();
    if (!found.motion.success) return Vector6d(Vector6d::Zero());
    const Eigen::Isometry3d motion = found.motion.T_current_reference.inverse();
    return Vector6d(logSE3(motion) / state_.prior.interval(scene->map.secondsUntil(pair.features()), motion));
  };
  const auto findSynchronised = [&] {
    constexpr double kNegligible = 0.02;  // px (chosen): a fifth of a disparity's noise
    const Vector6d velocity = find();
    if (pair.is != Pair::kFollowed || !pair.synchronised || !found.motion.success) return velocity;
    const double delay = pair.taken().right_delay + state_.rig.calibration.delay();
    const double unexpected = (velocity - *state_.prior.velocity()).tail<3>().norm();
    if (std::abs(delay) * pair.given.camera.fx * unexpected < kNegligible) return velocity;
    pair.synchronised = synchronised(pair.taken(), pair.dt, velocity);
    roll(pair, velocity);
    return find();
  };
  const auto findGlobal = [&] {
    constexpr int kPasses = 3;  // at most; each leaves some hundredths of the velocity's error
    Vector6d velocity = findSynchronised();
    for (int pass = 0; pass < kPasses && pair.rolled && found.motion.success && rollAgain(pair, found); ++pass)
      velocity = find();
    return velocity;
  };
  const auto shownBeyond = [&](const Eigen::Vector3d& supposed) {
    const Vector6d velocity = findGlobal();
    const Eigen::Vector3d turn = pair.dt * velocity.tail<3>();
    const Eigen::Vector3d before = pair.dt * state_.prior.velocity().value_or(Vector6d::Zero()).tail<3>();
    const Eigen::Matrix3d turns = turn * turn.transpose() + before * before.transpose();
    return state_.rig.shownRotation(pair.features(), found, supposed, turns, pair.dt);
  };
  const auto compensateFor = [&](const ShownRotation& shown) { pair.rotation = shown, compensate(pair); };
  pair.rotation = shownBeyond(Eigen::Vector3d::Zero());
  if (pair.is == Pair::kFollowed && scene->T_current_reference && !found.isOfMajority()) {
    // After a knock beyond the matches' noise no motion explains both views, but the left one alone may be explained.
    const ShownRotation at_first = pair.rotation;
    const int inliers = found.agreement.inliers;
    const Eigen::Vector3d yaw = yawByDisparities(pair.given.camera, found.correspondences, *scene->T_current_reference);
    compensateFor({yaw, Eigen::Matrix3d::Zero(), kCertain, kUnsuspected});
    pair.rotation = shownBeyond(yaw);
    if (!found.motion.success || found.agreement.inliers <= inliers || !(pair.rotation.log_odds > 0.0))
      compensateFor(at_first), findGlobal();
  }
  if (!(pair.rotation.log_odds > 0.0)) return;
  compensate(pair);
  findGlobal();
}

/// Expected motion over the `dt` s since the previous pair: the guess, else the prediction.
std::optional<Eigen::Isometry3d> VisualOdometry::Impl::expectedMotion(double dt,
                                                                      const std::optional<MotionGuess>& guess) const {
  if (guess) return motionBy(*guess, state_.prior, dt);
  if (state_.interrupted || !state_.prior.velocity() || dt > options_.tracking.max_gap) return std::nullopt;
  return state_.prior.predicted(dt).motion;
}

/// Log-odds that images repeat although the camera moved. The guess, or the last motion, implies whether it did. A
/// robot may stop from one pair to the next as far as the prior allows; the first repeated pair decides.
double VisualOdometry::Impl::logOddsOfFrozen(const StereoFeatures& features, double dt,
                                             const std::optional<MotionGuess>& guess) const {
  const RepeatedImages& images = state_.images;
  if (!images.repeat(features)) return kUnsuspected;
  const auto moved = [&](const Eigen::Isometry3d& T_previous_current) {
    return RepeatedImages::shouldHaveMoved(features, state_.rig.noise.sameMotion(), T_previous_current);
  };
  if (guess && !guess->rotation_only) return moved(guess->T_previous_current) ? kCertain : kUnsuspected;
  if (state_.frozen) return kCertain;
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  if (guess) turn.linear() = guess->T_previous_current.linear();
  if (moved(turn)) return kCertain;
  const auto prior = state_.prior.confirmed(*state_.last_stamp, dt);
  const auto expected = expectedMotion(dt, std::nullopt);
  if (!prior || !moved(expected.value_or(prior->motion))) return kUnsuspected;
  if (images.comeTwice()) return kCertain;
  if (images.inARow() > 0 && images.logOddsOfOld() < kCertain) return kUnsuspected;
  const double stop = 0.5 * prior->normalisedSquare(Eigen::Isometry3d::Identity(), Matrix6d::Zero());
  return std::min(images.logOddsOfOld() + std::min(stop, -std::log(kTailProbability)), kCertain);
}

/// The map, the pair, and the expected motion between them: that of predicted pairs since the reference, then the
/// velocity or the guess.
MotionScene VisualOdometry::Impl::sceneOf(const LocalMap& map, const StereoFeatures& features, double dt,
                                          const std::optional<MotionGuess>& guess) const {
  const MotionPrior& prior = state_.prior;
  MotionScene scene{map,
                    state_.rig.calibration.calibration(),
                    features,
                    {},
                    {},
                    {},
                    state_.doubt.lasts(),
                    state_.doubt.logOdds() > largestDoubt(),
                    options_.tracking.doubtful_deviation,
                    state_.rig.noise};
  const Eigen::Isometry3d T_reference_previous = map.newestPose() * state_.T_origin_camera;
  const double since = map.secondsUntil(features);
  if (const auto confirmed = prior.confirmed(map.newestStamp(), since)) scene.prior.push_back(*confirmed);
  if (prior.velocity() && dt <= options_.tracking.max_gap)
    scene.T_current_reference = (T_reference_previous * prior.predicted(dt).motion).inverse();
  if (guess) {
    scene.guess = (T_reference_previous * motionBy(*guess, prior, dt)).inverse();
    if (!scene.prior.empty()) scene.prior.push_back(prior.around(scene.guess->inverse(), since));
  }
  return scene;
}

/// The features at the time of the left image; none if no delay is known.
std::optional<StereoFeatures> VisualOdometry::Impl::synchronised(const StereoFeatures& taken, double dt,
                                                                 const Vector6d& velocity) const {
  const double known = state_.rig.calibration.delay();
  if (taken.right_delay + known == 0.0) return std::nullopt;
  return state_.rig.right_delay.synchronised(taken, dt, velocity, known);
}

/// The pair with its measured motion; none without a motion, or with one that spans an outage.
std::optional<MeasuredPair> VisualOdometry::Impl::measuredPair(const Pair& pair, const MotionHypothesis& found) const {
  if (!found.motion.success || state_.interrupted || !(pair.dt > 0.0)) return std::nullopt;
  const StereoFeatures& taken = pair.taken();
  const Eigen::Isometry3d& motion = found.motion.T_current_reference;
  const double since = state_.prior.interval(state_.map->secondsUntil(taken), motion);
  return MeasuredPair{
      taken, state_.prior.interval(pair.dt, motion), motion, since,
      rowMotions(taken, found, since, state_.rig.row_pattern, taken.right_delay + state_.rig.calibration.delay())};
}

/// Evidence of the pair that its motion is not the camera's.
std::vector<Evidence> VisualOdometry::Impl::evidenceAgainst(const Pair& pair, const MotionHypothesis& found,
                                                            const std::optional<MeasuredPair>& measured) {
  LearntRig& rig = state_.rig;
  // The map is from before the rotation.
  std::vector<Evidence> evidence{{pair.rotation.log_odds, pair.rotation.words()},
                                 {pair.rotation.other_moment, "the right image seemed to be of another moment"}};
  if (pair.features().report.refused) evidence.push_back({kCertain, "left and right did not belong together"});
  if (pair.is == Pair::kFollowed)
    evidence.push_back({pair.frozen, "images as of the previous pair, by a stop or a frozen driver", true});
  // After a short gap, the views may not be of one rigid world, and the next map would be as wrong.
  if (pair.is == Pair::kFollowed && !found.motion.success && found.agreement.matches >= kManyMatches &&
      pair.dt <= options_.tracking.max_gap)
    evidence.push_back({kCertain, "many matches agreed on no motion", true});
  if (!measured) return evidence;
  rig.right_delay.watch(measured->rows, measured->dt, options_.noise.corner * rig.noise.scale());
  const RightCameraDelay::OtherPair other = rig.right_delay.otherPair(measured->dt);
  evidence.push_back({other.log_odds, other.words()});
  evidence.push_back(
      {kUnsuspected + state_.prior.logRatioOfSwap(measured->T_current_reference.inverse(), measured->since_reference),
       "neighbouring pairs seemed to have changed places"});
  return evidence;
}

/// Log-odds that a motion is not the camera's, above which it is doubtful.
double VisualOdometry::Impl::largestDoubt() const {
  return logOdds(1.0 - options_.tracking.probability);
}

/// Searches the pair in the map from before an outage, in the one before that, then in the seed. The camera's motion
/// meanwhile is unknown.
std::optional<MotionScene> VisualOdometry::Impl::reacquire(const StereoFeatures& features) const {
  std::optional<MotionScene> scene;
  for (const LocalMap* map : {&*state_.map, state_.left ? &state_.left->map : nullptr}) {
    if (!map || !map->continuedBy(features)) continue;
    const auto place = reacquisition_.find(*map, features, state_.rig.calibration.calibration());
    const double since = map->secondsUntil(features);
    if (!place || !state_.prior.tooFast(place->T_current_newest.inverse(), Matrix6d::Zero(), since).empty()) continue;
    scene.emplace(sceneOf(*map, features, 0.0, std::nullopt));
    scene->place = weigh(*place, scene->prior);
    scene->T_current_reference = scene->place->T_current_newest;
    scene->prior.clear();
    return scene;
  }
  if (state_.seed) scene.emplace(sceneOf(*state_.seed, features, 0.0, std::nullopt));
  return scene;
}

/// Updates what each pair changes, whatever its motion.
void VisualOdometry::Impl::begin(const Pair& pair, const std::optional<MotionGuess>& guess) {
  const StereoFeatures& features = pair.features();
  if (state_.camera && *state_.camera != features.camera) state_.forgetRig(options_);
  state_.camera = features.camera;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  if (pair.dt <= options_.tracking.max_gap) state_.prior.noteInterval(pair.dt);
  state_.outage.extend(pair.dt, guess, state_.prior);
  state_.rig.calibration.predict(std::min(pair.dt, options_.tracking.max_gap));  // a clock's jump ages no rig
  if (pair.rotation.log_odds > 0.0) state_.rig.rotate(pair.rotation, features.camera);
}

/// Updates the state by the pair's step.
void VisualOdometry::Impl::finish(const Pair& pair, Step& step) {
  const StereoFeatures& features = pair.features();
  state_.doubt.fade();
  const auto stood = [&step] {
    const Vector6d motion = logSE3(*step.T_previous_current);
    return mahalanobisSquare(motion, step.covariance) < noiseGate(6);
  };
  state_.images.remember(pair.whole(), step.state == TrackingState::kTracking && step.T_previous_current && stood());
  state_.frozen = pair.is == Pair::kFrozen;
  if (pair.new_part && step.reason.empty()) step.reason = "a part of the left image repeats that of the previous pair";
  const bool since_pose = step.T_previous_current && state_.last_pose_stamp;
  step.dt = since_pose ? static_cast<double>(features.stamp - *state_.last_pose_stamp) * 1e-9 : pair.dt;
  if (step.T_previous_current) state_.move(*step.T_previous_current);
  if (!step.hasPose()) return;
  state_.last_pose_stamp = features.stamp;
  state_.outage.havePose();
}

/// The pair joins the map unless its motion is rejected, before or after the adjustment.
VisualOdometry::Impl::Step VisualOdometry::Impl::extendMap(const StereoFeatures& features, const MotionScene& scene,
                                                           MotionHypothesis& found, double dt,
                                                           const std::vector<Evidence>& evidence) {
  const auto passOver = [&](const std::string& why) {
    state_.doubt.raise(evidence);
    return state_.interrupted ? startMap(options_, features, state_)
                              : predictMotion(options_, features, dt, why, state_);
  };
  const double since = scene.map.secondsUntil(features);
  const std::string too_fast =
      state_.prior.tooFast(found.motion.T_current_reference.inverse(), found.motion.covariance, since);
  if (!too_fast.empty()) return passOver(too_fast);
  const Candidate candidate = adjustBeyondDoubt(features, scene, found);
  std::string refutation = search_.chanceWords(scene, found);
  if (refutation.empty()) refutation = state_.prior.tooFast(candidate.motion, found.motion.covariance, since);
  if (!refutation.empty()) return passOver(refutation + " after the adjustment");

  const bool is_seed = state_.seed && &scene.map == &*state_.seed, starts_again = is_seed && !state_.seed_has_pose;
  const bool comes_back = state_.left && &scene.map == &state_.left->map;
  if (starts_again) state_.startAgain();
  if (comes_back) state_.comeBack();
  if (is_seed) state_.covariance.beginMap();
  const Belief belief = state_.doubt.weigh(scene, found, evidence);
  commit(candidate, belief);
  Step step = measure(found, candidate);
  const Matrix6d measured = step.covariance;
  widen(scene, found, belief, step);
  const std::string doubt = doubtWords(scene, found, candidate, belief);
  step.state = doubt.empty() && !starts_again ? TrackingState::kTracking : TrackingState::kDegraded;
  step.probability = belief.probability;
  step.changes_epoch = starts_again || comes_back;
  if (!doubt.empty()) step.reason = "doubtful: " + doubt;
  // A motion that is probably not the camera's predicts nothing.
  if (belief.probability >= 0.5)
    state_.prior.takeVelocity(features.stamp, found.motion.T_current_reference.inverse(), since, measured,
                              doubt.empty(), step.covariance - measured);
  if (options_.planar.planar) {
    const std::string off = state_.floor.note(*floor(), state_.map->newestPose());
    if (step.reason.empty()) step.reason = off;
  }
  state_.outage.end();
  state_.seed.reset();
  if (comes_back) state_.left.reset();
  if (std::exchange(state_.interrupted, false))
    step.reason = (starts_again ? kStartedAgain
                   : is_seed    ? "goes on where the guess had the camera"
                                : "re-acquired by " + std::to_string(found.agreement.inliers) + " points of the map") +
                  (step.reason.empty() ? "" : "; " + step.reason);
  if (state_.map->newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// Adjusts the map with the pair. If it rejects so many inliers that the motion is not beyond doubt, all hypotheses
/// compete.
VisualOdometry::Impl::Candidate VisualOdometry::Impl::adjustBeyondDoubt(const StereoFeatures& features,
                                                                        const MotionScene& scene,
                                                                        MotionHypothesis& found) {
  const bool is_sound = !state_.doubt.lasts();
  const bool was_beyond_doubt = search_.isBeyondDoubt(found, largestDoubt());
  Candidate candidate = adjust(features, scene.map, found, is_sound);
  const std::size_t adjusted = found.sightings.size();
  found.reject(candidate.adjustment.rejected);
  if (!was_beyond_doubt || search_.isBeyondDoubt(found, largestDoubt())) return candidate;
  MotionScene suspected = scene;
  suspected.is_suspected = true;
  MotionHypothesis chosen = search_.find(suspected, largestDoubt());
  if (!chosen.motion.success) return candidate;
  const Eigen::Isometry3d T_adjusted = std::exchange(found, std::move(chosen)).motion.T_current_reference;
  // Mostly the first motion prevails, and its adjustment is known.
  if (found.sightings.size() != adjusted || found.motion.T_current_reference.matrix() != T_adjusted.matrix())
    candidate = adjust(features, scene.map, found, is_sound);
  found.reject(candidate.adjustment.rejected);
  return candidate;
}

/// Adjusts a copy of the map with the pair in it.
VisualOdometry::Impl::Candidate VisualOdometry::Impl::adjust(const StereoFeatures& features, const LocalMap& before,
                                                             const MotionHypothesis& found, bool may_recall) {
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
void VisualOdometry::Impl::widen(const MotionScene& scene, const MotionHypothesis& found, const Belief& belief,
                                 Step& step) {
  const auto add = [&](const Matrix6d& motion, const Matrix6d& pose) {
    step.covariance += motion;
    state_.covariance.doubt(motion, pose);
  };
  add(found.rivals_moment, found.rivals_moment);
  add(unexpected(scene, found), Matrix6d::Zero());  // stamps change the velocity, not the pose
  if (isDoubtful(belief)) add(belief.moment, belief.pose_moment);
  if (!scene.place) return;
  step.covariance += scene.place->moment;
  state_.covariance.spread(scene.place->moment);
}

/// Reason, if a motion has too small a probability or too large a covariance; else empty.
std::string VisualOdometry::Impl::doubtWords(const MotionScene& scene, const MotionHypothesis& found,
                                             const Candidate& candidate, const Belief& belief) const {
  if (isDoubtful(belief)) return belief.reason;
  Matrix6d covariance = candidate.adjustment.since_keyframe + unexpected(scene, found);
  if (scene.place) covariance += scene.place->moment;
  const double deviation = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  if (deviation <= options_.tracking.doubtful_deviation + kTolerableRatio * candidate.distance) return "";
  std::ostringstream words;
  if (found.innovation > noiseGate(6))
    words << innovationWords(found);
  else
    words << "a distance of " << candidate.distance << " m with a standard deviation of " << deviation
          << " m exceeds tracking/doubtful_deviation";
  return words.str() + (scene.place ? scene.place->reason : "");
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
  state_.rig.calibration.note(state_.map->oldestId(), state_.map->newestId(), candidate.calibration_by_rig,
                              candidate.calibration, adjustment.calibration_information);
  if (isDoubtful(belief)) return;
  state_.rig.noise.learnPair(adjustment.newest_square);
  if (adjustment.common_disparity_square) state_.rig.calibration.noteCommon(*adjustment.common_disparity_square);
}

/// The motion between the two reported poses, and its covariance.
VisualOdometry::Impl::Step VisualOdometry::Impl::measure(const MotionHypothesis& found, const Candidate& candidate) {
  const LocalMap& map = *state_.map;
  Step step;
  step.rejected_features = candidate.adjustment.rejected;
  step.T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  if (!candidate.adjustment.success) {
    step.covariance = found.motion.covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
    return step;
  }
  step.covariance = state_.covariance.measure(*step.T_previous_current, candidate.adjustment.since_keyframe,
                                              candidate.adjustment.growth);
  const Matrix6d by_rig = state_.covariance.expose(
      candidate.adjustment.by_calibration * candidate.calibration_by_rig, state_.rig.calibration.estimate(),
      RigEstimate::of(*state_.camera, candidate.calibration, candidate.delay));
  // The motion between two reported poses includes the map's correction of the first one. It is found as a perturbation
  // of the key frame, and reported as one of the newest pair.
  step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                    logSE3(candidate.T_keyframe_origin * map.poseBeforeNewest().inverse());
  state_.covariance.cover(step.correction);
  const bool by_chance = mahalanobisSquare(step.correction, step.covariance) <= noiseGate(6);
  step.covariance += lacking(step.covariance, step.correction) + by_rig;
  if (by_chance) return step;
  std::ostringstream reason;
  reason << "the map corrected the pose by " << step.correction.head<3>().norm() << " m and "
         << step.correction.tail<3>().norm() << " rad";
  step.reason = reason.str();
  return step;
}

std::optional<Floor> VisualOdometry::Impl::floor() const {
  if (!options_.planar.planar) return std::nullopt;
  return Floor(options_.planar, T_base_camera_, state_.floor.height());
}

std::vector<Eigen::Vector3d> VisualOdometry::Impl::mapPoints() const {
  return state_.map ? state_.map->positions() : std::vector<Eigen::Vector3d>();
}

}  // namespace sdvo
