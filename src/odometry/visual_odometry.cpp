#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <algorithm>
#include <stdexcept>

#include "../belief/belief.hpp"
#include "../common/stopwatch.hpp"
#include "map_update.hpp"
#include "odometry_state.hpp"
#include "pair_search.hpp"

namespace sdvo {
namespace {

/// The pose of an optical frame (z ahead, x right) at the origin of a base (x ahead, z up).
Eigen::Isometry3d lookingAhead() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return T_base_camera;
}

}  // namespace

/// The steps of a pair, in the order of update(), and what they remember.
class VisualOdometry::Impl {
 public:
  explicit Impl(const VisualOdometryOptions& given)
      : options(checked(given).withOneNoise()), tools(options), state(options, 0) {}

  OdometryResult update(const StereoFeatures& given, const std::optional<MotionGuess>& guess) {
    refuse(given);
    if (guess) guess->check();
    if (state.last_stamp) state.doubt.fade(state.secondsUntil(given.stamp));
    SearchedPair pair(options, tools, state, given, guess);

    // Nothing else of the state has changed so far, and from here on no input is rejected.
    Stopwatch stopwatch;
    begin(pair, guess);
    const std::optional<MeasuredPair> measured = measuredPair(pair);
    if (measured)
      state.rig.right_delay.updateOtherPair(measured->rows, measured->dt,
                                            options.noise.corner * state.rig.noise.scale());
    const std::vector<Evidence> evidence = evidenceAgainst(pair, measured);
    const MapUpdate map_update = updateMap(options, floor(), tools, pair, state);
    OdometryStep step = map_update.success ? measuredStep(options, floor(), pair, map_update, evidence, state)
                                           : unmeasured(pair, map_update.refusal, evidence);
    admitReadout(pair, measured, step);
    // The first pair, without a scene, is TRACKING without a motion.
    state.rig.learn(pair.features, measured ? &*measured : nullptr, pair.found, pair.rotation,
                    step.state == TrackingState::kTracking && pair.scene);
    finish(pair, step);
    rememberRolled(pair, step);
    step.time = stopwatch.lap();
    const OdometryResult result = checkedResult(state.report(pair, step, floor()));
    if (state.shutter.isEstimated()) state.shutter.takeEstimate(state.rig.readout.usableValue());
    // A driver's fault is short: a calibration that lasts is new.
    if (result.has_pose && pair.refutes_camera_info &&
        1e-9 * static_cast<double>(given.stamp - *state.camera_info_stamp) > options.tracking.max_gap)
      state.recalibrate(options, given);
    return result;
  }

  VisualOdometryOptions options;
  Eigen::Isometry3d T_base_camera = lookingAhead();
  OdometryTools tools;
  OdometryState state;

 private:
  std::optional<Floor> floor() const {
    if (!options.planar.planar) return std::nullopt;
    return Floor(options.planar, T_base_camera, state.floor.height());
  }

  void refuse(const StereoFeatures& features) const {
    features.check();
    if (state.last_stamp && features.stamp <= *state.last_stamp)
      throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                  std::to_string(*state.last_stamp) + " ns");
  }

  /// Updates what each pair changes, whatever its motion.
  void begin(const SearchedPair& pair, const std::optional<MotionGuess>& guess) {
    const StereoFeatures& features = pair.features;
    if (state.map_camera && *state.map_camera != features.camera) state.forgetRig(options);
    state.map_camera = features.camera;
    state.pair_camera = pair.camera;
    if (!pair.refutes_camera_info) state.camera_info_stamp = features.stamp;
    state.last_stamp = features.stamp;
    ++state.pairs;
    if (pair.dt <= options.tracking.max_gap) state.prior.noteInterval(pair.dt);
    state.outage.extend(pair.dt, guess, state.prior);
    if (features.report.refused) state.outage.noteRefused();
    const RigEstimate before = state.rig.calibration.estimate();
    // A clock's jump ages no rig.
    RigEstimate::Matrix step_covariance = state.rig.calibration.predict(std::min(pair.dt, options.tracking.max_gap));
    if (pair.rotation.log_odds > 0.0) step_covariance += state.rig.rotate(pair.rotation, features.camera);
    state.walkRig(before, step_covariance);
  }

  /// The pair with its measured motion; none without a motion, or with one after an interruption.
  std::optional<MeasuredPair> measuredPair(const SearchedPair& pair) const {
    if (!pair.found.motion.success || state.interrupted || !(pair.dt > 0.0)) return std::nullopt;
    const Eigen::Isometry3d& motion = pair.found.motion.T_current_reference;
    const double since = state.prior.interval(state.map->secondsUntil(pair.rotated_back), motion);
    return MeasuredPair{pair.rotated_back, state.prior.interval(pair.dt, motion), motion, since,
                        state.rig.rowMotions(pair.rotated_back, pair.found, since)};
  }

  /// Evidence of the pair that its motion is not the camera's.
  std::vector<Evidence> evidenceAgainst(const SearchedPair& pair, const std::optional<MeasuredPair>& measured) const {
    constexpr int kManyMatches = 100;  // of a pair (chosen): if no motion fits so many, points are not lacking
    // After a new rotation the motion may be wrong: the map was made before it, the pair after it.
    std::vector<Evidence> evidence{
        {pair.rotation.log_odds, pair.rotation.words()},
        {pair.rotation.log_odds_of_other_moment, "the right image seemed to be of another moment"}};
    if (pair.features.report.refused) evidence.push_back({kCertain, "left and right did not belong together"});
    // A map that begins after such a pair may have a late right image, too: no earlier map contradicts its depths.
    if (state.outage.hasRefused() && pair.in_fallback_map)
      evidence.push_back({kCertain, "left and right of pairs before it did not belong together", true});
    if (pair.kind == SearchedPair::kContinues) {
      evidence.push_back(
          {pair.log_odds_of_frozen, "images as of the previous pair, by a stop or a frozen driver", true});
      // Little changes within max_gap: left and right may disagree, also in the map that this pair begins.
      if (!pair.found.motion.success && pair.found.agreement.matches >= kManyMatches &&
          pair.dt <= options.tracking.max_gap)
        evidence.push_back({kCertain, "many matches agreed on no motion", true});
    }
    if (!measured) return evidence;
    const RightCameraDelay::OtherPair other = state.rig.right_delay.otherPair(measured->dt);
    evidence.push_back({other.log_odds, other.words()});
    evidence.push_back(
        {kUnsuspected + state.prior.logRatioOfSwap(measured->T_current_reference.inverse(), measured->since_reference),
         "neighbouring pairs seemed to have changed places"});
    return evidence;
  }

  /// The step of a pair that does not join the map.
  OdometryStep unmeasured(const SearchedPair& pair, const std::string& why, const std::vector<Evidence>& evidence) {
    state.doubt.raise(evidence);
    if (pair.kind == SearchedPair::kFrozen) return holdPose(pair.dt, state);
    if (pair.kind == SearchedPair::kContinues) return predictMotion(options, pair.features, pair.dt, why, state);
    return startMap(options, pair.features, state);
  }

  /// Widens covariances by what is unknown of the shutter's readout.
  void admitReadout(const SearchedPair& pair, const std::optional<MeasuredPair>& measured, OdometryStep& step) {
    if (!measured || !step.T_previous_current || !state.shutter.isEstimated()) return;
    const Matrix6d moment =
        state.rig.readout.momentOf(measured->features, pair.found, measured->since_reference, state.shutter.readout());
    step.covariance += moment;
    state.covariance.addDoubt(moment, moment);
  }

  /// Updates the state by the pair's step.
  void finish(const SearchedPair& pair, OdometryStep& step) {
    const StereoFeatures& features = pair.features;
    std::optional<bool> stood;
    if (step.state == TrackingState::kTracking && step.T_previous_current)
      stood = mahalanobisSquare(Vector6d(logSE3(*step.T_previous_current)), step.covariance) < noiseGate(6);
    state.images.remember(pair.whole, stood);
    state.frozen = pair.kind == SearchedPair::kFrozen;
    if (pair.repeats_a_part && step.reason.empty())
      step.reason = "a part of the left image repeats that of the previous pair";
    if (pair.refutes_camera_info && step.reason.empty())
      step.reason = "camera_info changed, but the images did not: the calibration before it is used";
    const bool since_pose = step.T_previous_current && !step.changes_epoch && state.last_pose_stamp;
    step.dt = since_pose ? static_cast<double>(features.stamp - *state.last_pose_stamp) * 1e-9 : pair.dt;
    if (step.T_previous_current) state.move(*step.T_previous_current);
    if (!step.hasPose()) return;
    state.last_pose_stamp = features.stamp;
    state.outage.havePose();
  }

  /// Widens covariances by the error of the pair's velocity, and keeps the pair until the next motion is known.
  void rememberRolled(SearchedPair& pair, OdometryStep& step) {
    if (!pair.rolled) state.newest_rolled.reset();  // the next motion is not from there
    const auto ends_with_it = [&](const std::optional<LocalMap>& map) {
      return map && map->newestStamp() == pair.features.stamp;
    };
    if (!pair.rolled || (!ends_with_it(state.map) && !ends_with_it(state.fallback_map))) return;
    RolledPair& rolled = *pair.rolled;
    if (!pair.found.motion.success || !step.T_previous_current) {
      rolled.forgetMotion();
    } else {
      const Matrix6d moment = state.shutter.covarianceByVelocity(rolled);
      step.covariance += moment;
      state.covariance.addDoubt(moment, moment);
    }
    if (state.newest_rolled && rolled.mean_velocity) state.shutter.learn(*state.newest_rolled, *rolled.mean_velocity);
    state.newest_rolled = std::move(pair.rolled);
  }

  /// The only way out of update(): no result leaves with a number that is not finite or an indefinite covariance.
  OdometryResult checkedResult(OdometryResult result) {
    const std::string defect = result.defect();
    if (defect.empty()) {
      if (result.has_pose) state.last_sound = state.lastPose();
      return result;
    }
    state.restartAt(state.last_sound, options);  // the cause may be anywhere in the memory
    OdometryResult lost;
    lost.state = TrackingState::kLost;
    lost.reason = "defect of the odometry: " + defect + "; goes on from the last sound pose. Please report it";
    lost.stamp = result.stamp, lost.epoch = result.epoch, lost.dt = result.dt;
    lost.features = result.features, lost.matches = result.matches, lost.distance = state.distance;
    return lost;
  }
};

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options) : impl_(std::make_unique<Impl>(options)) {}
VisualOdometry::~VisualOdometry() = default;

OdometryResult VisualOdometry::update(const StereoFeatures& features, const std::optional<MotionGuess>& guess) {
  return impl_->update(features, guess);
}

void VisualOdometry::reset() {
  impl_->state = OdometryState(impl_->options, impl_->state.epoch + 1);
}

void VisualOdometry::breakStream() {
  impl_->state.interrupt();
}

void VisualOdometry::setPoseCovariance(const Matrix6d& covariance) {
  OdometryResult given;
  given.has_pose = true, given.pose_covariance = covariance;
  if (const std::string defect = given.defect(); !defect.empty()) throw std::invalid_argument(defect);
  OdometryState& state = impl_->state;
  state.covariance.reset(covariance);
  state.earlier.reset();  // its poses are from before
  ++state.epoch;
  if (!state.interrupted) return;
  state.map.reset();
  state.started = false;  // the next pair starts a map there, as a first pair, without another epoch
}

const Eigen::Isometry3d& VisualOdometry::lastPose() const {
  return impl_->state.T_origin_camera;
}

void VisualOdometry::configure(const VisualOdometryOptions& options) {
  impl_->options = checked(options).withOneNoise();
  impl_->tools = OdometryTools(impl_->options);
  impl_->state.prior.configure(options.tracking);
}

const VisualOdometryOptions& VisualOdometry::options() const {
  return impl_->options;
}

void VisualOdometry::mountAt(const Eigen::Isometry3d& T_base_camera) {
  checkRigid(T_base_camera, "the camera's pose on the base");
  OdometryState& state = impl_->state;
  const Eigen::Isometry3d T_before_now = impl_->T_base_camera.inverse() * T_base_camera;
  const bool is_same = T_base_camera.matrix() == impl_->T_base_camera.matrix();
  impl_->T_base_camera = T_base_camera;
  if (is_same || !state.last_pose_stamp) return;
  // Maps, velocities and guesses up to now are in the old camera's axes; the floor is in the base's.
  const FloorBelief floor = state.floor;
  const Eigen::Isometry3d T_now_before = T_before_now.inverse();
  ReportedPose last = state.lastPose();
  last.T_origin_camera = orthonormalised(T_now_before * last.T_origin_camera * T_before_now);
  last.covariance = carried(T_now_before, last.covariance);
  state.restartAt(last, impl_->options);
  state.floor = floor;
}

std::vector<Eigen::Vector3d> VisualOdometry::mapPoints() const {
  const std::optional<LocalMap>& map = impl_->state.map;
  return map ? map->positions() : std::vector<Eigen::Vector3d>();
}

}  // namespace sdvo
