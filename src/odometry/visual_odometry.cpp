#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "stereo_descriptor_vo/common/stopwatch.hpp"
#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

namespace sdvo {
namespace {

constexpr int kWatched = 5;         // pairs after a motion was contested
constexpr int kEnoughLasting = 20;  // fewer matches of lasting points do not tell which motion is the camera's

/// How much less a predicted motion is known than a measured one: constant velocity errs by the acceleration, for which
/// a vehicle's 5 m/s^2 and 2 rad/s^2 stand.
Matrix6d predictionCovariance(double dt) {
  const double translation = 0.5 * 5.0 * dt * dt, rotation = 0.5 * 2.0 * dt * dt;
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variance.asDiagonal();
}

/// What could have been travelled unseen, by a vehicle that went on as before and accelerated as above.
Matrix6d travelCovariance(const Vector6d& velocity, double seconds, double max_speed) {
  const double translation =
      std::min(velocity.head<3>().norm() * seconds + 0.5 * 5.0 * seconds * seconds, max_speed * seconds);
  const double rotation = std::min(velocity.tail<3>().norm() * seconds + 0.5 * 2.0 * seconds * seconds, CV_PI);
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variance.asDiagonal();
}

/// Share of the cells over the image that hold one of the pair's rows.
double coverage(const StereoFeatures& features, const std::vector<int>& inlier_rows) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  for (const int i : inlier_rows) {
    const int column = static_cast<int>(features.u[i] * kColumns / features.camera.width);
    const int row = static_cast<int>(features.v[i] * kRows / features.camera.height);
    cells.set(static_cast<std::size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)));
  }
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

/// Rows of the pair that the motion's inliers matched, but for the rejected ones.
std::vector<int> inlierRows(const std::vector<FeatureMatch>& matches, const std::vector<int>& inliers,
                            const std::vector<int>& rejected = {}) {
  std::vector<int> rows;
  for (const int i : inliers)
    if (std::find(rejected.begin(), rejected.end(), matches[i].current) == rejected.end())
      rows.push_back(matches[i].current);
  return rows;
}

/// Rows that are among the first but not among the second.
std::vector<int> rowsOnlyIn(std::vector<int> first, std::vector<int> second) {
  std::sort(first.begin(), first.end());
  std::sort(second.begin(), second.end());
  std::vector<int> rows;
  std::set_difference(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(rows));
  return rows;
}

/// As large in every direction as two motions differ.
Matrix6d disagreement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Vector6d difference = logSE3(a.inverse() * b);
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(difference.head<3>().squaredNorm()),
      Eigen::Vector3d::Constant(difference.tail<3>().squaredNorm());
  return variance.asDiagonal();
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
    : options_(checked(options)), matcher_(options.matcher), estimator_(options.motion), state_(options.calibration) {}

void VisualOdometry::configure(const VisualOdometryOptions& options) {
  options_ = checked(options);
  matcher_ = FeatureMatcher(options.matcher);
  estimator_ = MotionEstimator(options.motion);
}

void VisualOdometry::reset() {
  state_ = State(options_.calibration);
  ++epoch_;
}

void VisualOdometry::breakStream() {
  state_.map.reset();
  state_.velocity.reset();
}

OdometryResult VisualOdometry::update(const StereoFeatures& features) {
  refuse(features);
  const double dt = state_.last_stamp ? static_cast<double>(features.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  const bool continued = state_.map && state_.map->continuedBy(features);
  const bool frozen = isFrozen(features, dt);
  const Localisation found = continued && !frozen ? localise(features, dt) : Localisation{};

  // Nothing has changed so far, and from here on nothing is refused.
  Stopwatch stopwatch;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  state_.right_rotation.add(features);
  state_.frozen = frozen;
  state_.contested_pairs = found.contested ? kWatched : std::max(0, state_.contested_pairs - 1);
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

VisualOdometry::Localisation VisualOdometry::localise(const StereoFeatures& features, double dt) const {
  // The motion since the map's newest pair: what was already covered by predicted pairs, and the velocity from there
  // on.
  std::optional<Eigen::Isometry3d> prior;
  if (state_.velocity && dt <= options_.tracking.max_gap)
    prior = (state_.map->newestPose() * state_.T_origin_camera * expSE3(*state_.velocity * dt)).inverse();
  Localisation found = search(features, prior);
  if (found.verdict.trust == Trust::kSound && state_.contested_pairs == 0) {
    align(features, found);
    if (!hasStrayed(features.camera, found)) return found;
    found.sightings.clear();
  }

  // The prior itself may be what misled the search, and what moves by itself may outnumber the world.
  std::vector<Localisation> hypotheses = {std::move(found)};
  if (prior) hypotheses.push_back(search(features, std::nullopt));
  const Localisation all = hypotheses.back();
  std::vector<int> lasting, outliers;
  for (int i = 0; i < static_cast<int>(all.matches.size()); ++i) {
    if (isLasting(all, i)) lasting.push_back(i);
    if (!std::binary_search(all.motion.inliers.begin(), all.motion.inliers.end(), i)) outliers.push_back(i);
  }
  for (const std::vector<int>& subset : {lasting, outliers}) hypotheses.push_back(searchAmong(features, all, subset));
  found = choose(std::move(hypotheses));
  if (found.verdict.trust != Trust::kNone) align(features, found);
  return found;
}

/// A motion that some of another hypothesis' matches agree on, and whatever else does.
VisualOdometry::Localisation VisualOdometry::searchAmong(const StereoFeatures& features, const Localisation& all,
                                                         const std::vector<int>& subset) const {
  Stopwatch stopwatch;
  Localisation found = all;
  found.match_time = 0.0;
  found.motion = estimateAmong(estimator_, features.camera, all.correspondences, subset);
  if (found.motion.success)
    found.motion.inliers = PoseProblem(features.camera, all.correspondences, options_.motion.inlier_threshold)
                               .inliers(found.motion.T_current_reference);
  weigh(features, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// Whether a match is one of a point that stood still in several pairs.
bool VisualOdometry::isLasting(const Localisation& found, int match) const {
  constexpr int kPairs = 4;
  return found.view.seen[found.matches[match].reference] >= kPairs;
}

/// Whether most lasting points lie beside their aligned sightings: a motion between those of two things, which agrees
/// roughly with both.
bool VisualOdometry::hasStrayed(const StereoCamera& camera, const Localisation& found) const {
  constexpr double kClose = 1.0;  // px
  constexpr double kMost = 0.6;
  int lasting = 0, close = 0;
  for (std::size_t k = 0; k < found.sightings.size(); ++k) {
    const int i = found.motion.inliers[k];
    const LocalMap::Sighting& sighting = found.sightings[k];
    if (!sighting.aligned || !isLasting(found, i)) continue;
    const Eigen::Vector3d point = found.motion.T_current_reference * found.correspondences[i].point;
    ++lasting;
    close += (camera.project(point) - sighting.measurement).head<2>().norm() < kClose;
  }
  return lasting >= kEnoughLasting && close < kMost * lasting;
}

/// Takes the hypothesis that most lasting points agree with, for they stood still so far; where they do not tell, the
/// one that goes on as before. What the others say confirms it or speaks against it.
VisualOdometry::Localisation VisualOdometry::choose(std::vector<Localisation> hypotheses) const {
  const auto change = [&](const Localisation& of) {
    return (expSE3(*state_.velocity * -of.evidence.dt) * of.evidence.motion).translation().norm();
  };
  const auto isBetter = [&](const Localisation& a, const Localisation& b) {
    if (a.motion.success != b.motion.success) return a.motion.success;
    constexpr int kVotes = 8;
    const int lasting_a = a.lasting_close, lasting_b = b.lasting_close;
    if (lasting_a + lasting_b >= kVotes && (lasting_a >= 2 * lasting_b || lasting_b >= 2 * lasting_a))
      return lasting_a > lasting_b;
    const bool comparable = b.evidence.inliers > leastOfRival(a.motion) && a.evidence.inliers > leastOfRival(b.motion);
    if (state_.velocity && comparable && !areOne(a, b)) return change(a) < change(b);
    return a.evidence.inliers > b.evidence.inliers;
  };
  std::size_t best = 0;
  double match_time = 0.0, motion_time = 0.0;
  for (std::size_t k = 0; k < hypotheses.size(); ++k) {
    const bool same =
        best != k && hypotheses[best].verdict.trust == Trust::kSound && areOne(hypotheses[best], hypotheses[k]);
    if (!same && isBetter(hypotheses[k], hypotheses[best])) best = k;
    match_time += hypotheses[k].match_time;
    motion_time += hypotheses[k].motion_time;
  }
  Localisation& chosen = hypotheses[best];
  chosen.match_time = match_time;
  chosen.motion_time = motion_time;
  if (!chosen.motion.success) return std::move(chosen);

  const Localisation* rival = nullptr;
  std::vector<int> of_rival;  // rows that the rival explains and the chosen one does not
  const std::vector<int> own = inlierRows(chosen.matches, chosen.motion.inliers);
  for (const Localisation& other : hypotheses) {
    if (&other == &chosen || !other.motion.success) continue;
    if (areOne(chosen, other)) {
      chosen.evidence.confirmed |= chosen.guided != other.guided;  // from matches of their own
      continue;
    }
    std::vector<int> rows = rowsOnlyIn(inlierRows(other.matches, other.motion.inliers), own);
    if (static_cast<int>(rows.size()) >= leastOfRival(chosen.motion) && rows.size() > of_rival.size())
      rival = &other, of_rival = std::move(rows);
  }
  // What the rival explains does not speak against the chosen one.
  chosen.evidence.matches -=
      static_cast<int>(std::count_if(chosen.matches.begin(), chosen.matches.end(), [&](const FeatureMatch& match) {
        return std::binary_search(of_rival.begin(), of_rival.end(), match.current);
      }));
  chosen.verdict = judgePose(options_.tracking, options_.motion.min_inliers, chosen.evidence);
  // Less than that is something small that moves, or a texture that repeats itself; unless it was larger just before.
  const double substantial_share = state_.contested_pairs > 0 ? 0.0 : 0.35;
  const bool substantial = static_cast<double>(of_rival.size()) >= substantial_share * chosen.evidence.inliers;
  chosen.contested = lastingDisagree(chosen.evidence);
  if (rival && (substantial ? chosen.verdict.trust != Trust::kNone : chosen.verdict.trust == Trust::kDoubtful)) {
    chosen.contested = true;
    chosen.T_current_reference_else = rival->motion.T_current_reference;
    chosen.verdict = {Trust::kDoubtful, "two motions in view, of " + std::to_string(own.size()) + " and " +
                                            std::to_string(of_rival.size()) +
                                            " matches: does something move before the camera?"};
  }
  return std::move(chosen);
}

/// Whether a motion is not that of the points that stood still so far.
bool VisualOdometry::lastingDisagree(const PoseEvidence& evidence) const {
  return evidence.lasting_matches >= kEnoughLasting &&
         evidence.lasting_inliers < options_.tracking.doubtful_lasting_ratio * evidence.lasting_matches;
}

/// Whether two hypotheses mean one motion.
bool VisualOdometry::areOne(const Localisation& a, const Localisation& b) const {
  return a.motion.success && b.motion.success &&
         agree(state_.map->camera(), a.correspondences, a.motion.inliers, a.motion.T_current_reference,
               b.motion.T_current_reference);
}

/// Fewer inliers than that are no rival of a motion.
int VisualOdometry::leastOfRival(const MotionEstimate& motion) const {
  constexpr double kLeast = 0.1;
  return std::max(2 * options_.motion.min_inliers,
                  static_cast<int>(kLeast * static_cast<double>(motion.inliers.size())));
}

/// Gathers what speaks for the motion found and judges it.
void VisualOdometry::weigh(const StereoFeatures& features, Localisation& found) const {
  const std::vector<int>& inliers = found.motion.inliers;
  const auto lasts = [&](int match) { return isLasting(found, match); };
  PoseEvidence& evidence = found.evidence;
  evidence = {};
  evidence.matches = static_cast<int>(found.matches.size());
  evidence.inliers = static_cast<int>(inliers.size());
  for (int i = 0; i < evidence.matches; ++i) evidence.lasting_matches += lasts(i);
  evidence.lasting_inliers = static_cast<int>(std::count_if(inliers.begin(), inliers.end(), lasts));
  found.lasting_close = static_cast<int>(std::count_if(inliers.begin(), inliers.end(), [&](int i) {
    const auto residual =
        reprojectionResidual(features.camera, found.motion.T_current_reference, found.correspondences[i]);
    return lasts(i) && residual && residual->norm() < 0.5 * options_.motion.inlier_threshold;
  }));
  evidence.coverage = coverage(features, inlierRows(found.matches, inliers));
  evidence.rms = found.motion.rms;
  evidence.motion = found.motion.T_current_reference.inverse();
  evidence.covariance = found.motion.covariance;
  evidence.dt = static_cast<double>(features.stamp - state_.map->newestStamp()) * 1e-9;
  evidence.velocity = state_.velocity;
  found.verdict = found.motion.success ? judgePose(options_.tracking, options_.motion.min_inliers, evidence)
                                       : PoseVerdict{Trust::kNone, found.motion.reason};
}

VisualOdometry::Localisation VisualOdometry::search(const StereoFeatures& features,
                                                    const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  Localisation found;
  found.guided = T_current_reference.has_value();
  found.view = state_.map->view();
  Stopwatch stopwatch;
  found.matches = matcher_.match(found.view.rows, features, T_current_reference);
  found.match_time = stopwatch.lap();
  found.correspondences = correspond(found.view.rows, features, found.matches);
  found.motion = estimator_.estimate(features.camera, found.correspondences);
  weigh(features, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// (u_left, v_left, u_right) of a feature whose position is known better by `shift`, px, without the rig's error.
Eigen::Vector3d VisualOdometry::measure(const StereoFeatures& features, int row, const Eigen::Vector2d& shift) const {
  const double u = features.u[row] + shift.x(), v = features.v[row] + shift.y();
  const double error = state_.calibration.calibration().disparityError(features.camera, u);
  return {u, v, u - (features.disparity[row] - error)};
}

std::vector<Correspondence> VisualOdometry::correspond(const DescribedPoints& reference, const StereoFeatures& features,
                                                       const std::vector<FeatureMatch>& matches) const {
  std::vector<Correspondence> correspondences;
  correspondences.reserve(matches.size());
  for (const FeatureMatch& match : matches)
    correspondences.push_back(
        {reference.positions[match.reference], measure(features, match.current, Eigen::Vector2d::Zero())});
  return correspondences;
}

/// Refines the motion on correspondences that have no outliers among them.
void VisualOdometry::refine(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
                            Eigen::Isometry3d& T_current_reference) const {
  std::vector<int> all(correspondences.size());
  std::iota(all.begin(), all.end(), 0);
  refineMotion(camera, options_.motion, correspondences, all, T_current_reference);
}

void VisualOdometry::align(const StereoFeatures& features, Localisation& found) const {
  constexpr std::size_t kEnough = 30;  // fewer are no better than all corners together
  Stopwatch stopwatch;
  const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * state_.map->newestPose();
  std::vector<Correspondence> aligned;
  for (const int i : found.motion.inliers) {
    const FeatureMatch& match = found.matches[i];
    const LocalMap::Sighting sighting = state_.map->sight(options_.alignment, features, T_camera_origin,
                                                          found.view.point[match.reference], match.current);
    found.sightings.push_back(sighting);
    if (!sighting.aligned) continue;
    const Eigen::Vector2d corner(features.u[match.current], features.v[match.current]);
    aligned.push_back({found.view.rows.positions[match.reference],
                       measure(features, match.current, sighting.measurement.head<2>() - corner)});
  }
  if (aligned.size() >= kEnough) refine(features.camera, aligned, found.motion.T_current_reference);
  found.motion_time += stopwatch.lap();
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
    const double unseen = static_cast<double>(features.stamp - state_.last_pose_stamp) * 1e-9;
    state_.covariance.restart(travelCovariance(state_.last_velocity, unseen, options_.tracking.max_speed));
    step.state = TrackingState::kDegraded;
    step.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    step.state = TrackingState::kTracking;
    step.reason = "first pair";
  }
  state_.started = true;
  state_.predicted_pairs = 0;
  state_.map.emplace(options_.map);
  state_.map->insert(features, state_.pairs, state_.T_origin_camera.inverse(), {}, state_.calibration.calibration());
  return step;
}

VisualOdometry::Step VisualOdometry::extendMap(const StereoFeatures& features, double dt, const Localisation& found) {
  LocalMap& map = *state_.map;
  std::optional<LocalMap> before;  // for a motion that the adjustment may refute
  if (found.verdict.trust != Trust::kSound) before = map;
  const double since_newest = static_cast<double>(features.stamp - map.newestStamp()) * 1e-9;

  const Eigen::Isometry3d newest_before = map.newestPose();
  const Eigen::Isometry3d T_previous_measured =
      (found.motion.T_current_reference * newest_before * state_.T_origin_camera).inverse();
  RigCalibration calibration = state_.calibration.calibration();
  map.insert(features, state_.pairs, found.motion.T_current_reference * map.newestPose(), found.sightings, calibration);
  const Eigen::Isometry3d T_before_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe() && found.verdict.trust == Trust::kSound) recall(features);
  const CalibrationBelief prior = state_.calibration.prior(map.oldestId());
  const LocalMap::Adjustment adjustment = map.adjust(options_.window, prior, calibration);
  map.renewLooks(features, found.sightings);

  Step step;
  step.rejected_rows = adjustment.rejected_rows;
  step.T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  PoseEvidence evidence = found.evidence;
  const std::vector<int> confirmed = inlierRows(found.matches, found.motion.inliers, step.rejected_rows);
  evidence.inliers = static_cast<int>(confirmed.size());
  evidence.coverage = coverage(features, confirmed);
  // What the adjustment did to the map as a whole is no motion.
  evidence.motion = newest_before * (T_before_origin.inverse() * map.poseBeforeNewest()) * map.newestPose().inverse();
  evidence.lasting_inliers = 0;
  for (const int i : found.motion.inliers)
    evidence.lasting_inliers += isLasting(found, i) && std::find(step.rejected_rows.begin(), step.rejected_rows.end(),
                                                                 found.matches[i].current) == step.rejected_rows.end();
  PoseVerdict verdict = judgePose(options_.tracking, options_.motion.min_inliers, evidence);
  if (verdict.trust == Trust::kNone) {
    // Without a map to go back to, what it has become is of no use.
    if (before)
      map = std::move(*before);
    else
      breakStream();
    return predict(features, dt, verdict.reason + " after the adjustment");
  }
  if (lastingDisagree(evidence)) state_.contested_pairs = kWatched;
  if (verdict.trust == Trust::kSound) verdict = found.verdict;
  const bool watched = verdict.trust == Trust::kSound && state_.contested_pairs > 0;
  if (watched) verdict = {Trust::kDoubtful, "a moment ago two motions were in view, or none was certain"};

  if (adjustment.success) {
    state_.calibration.note(map.newestId(), calibration, adjustment.calibration_information);
    step.covariance = state_.covariance.advance(*step.T_previous_current, adjustment.covariances);
    // As a perturbation of the frame before, then of the newest one.
    step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                      logSE3(T_before_origin * map.poseBeforeNewest().inverse());
    cover(step);
  } else {
    step.covariance = found.motion.covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
  }
  step.state = TrackingState::kTracking;
  if (verdict.trust == Trust::kDoubtful) {
    const Matrix6d doubted =
        watched ? state_.last_doubt : doubt(found, T_previous_measured, *step.T_previous_current, dt);
    state_.last_doubt = doubted;
    step.state = TrackingState::kDegraded;
    step.reason = "doubtful: " + verdict.reason;
    step.covariance += doubted;
    state_.covariance.doubt(doubted);
  }
  const Vector6d velocity = logSE3(found.motion.T_current_reference.inverse()) / since_newest;
  // Stamps that lie too close make no velocity.
  if (velocity.head<3>().norm() <= options_.tracking.max_speed &&
      velocity.tail<3>().norm() <= options_.tracking.max_rotation_rate)
    state_.velocity = state_.last_velocity = velocity;
  state_.predicted_pairs = 0;
  if (map.newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// A camera that comes back to where it was before is tied to the key frame that it left there.
void VisualOdometry::recall(const StereoFeatures& features) {
  LocalMap& map = *state_.map;
  const OldKeyframe* old = map.revisited();
  if (!old) return;
  const auto matches = matcher_.match(old->rows, features, map.newestPose() * old->T_camera_origin.inverse());
  MotionEstimate motion = estimator_.estimate(features.camera, correspond(old->rows, features, matches));
  if (!motion.success) return;

  std::vector<LocalMap::Tie> ties;
  std::vector<Correspondence> aligned;
  for (const int i : motion.inliers) {
    const FeatureMatch& match = matches[i];
    const OldKeyframe::Point& point = old->points[match.reference];
    const auto found = point.reference.findIn(options_.alignment, features, match.current,
                                              motion.T_current_reference * old->T_camera_origin, point.position);
    if (!found) continue;
    const Eigen::Vector3d& then = old->rows.positions[match.reference];
    const Eigen::Vector3d measurement = measure(features, match.current, found->shift);
    const double scale = then.z() / (motion.T_current_reference * then).z();
    ties.push_back({match.reference, match.current, measurement.head<2>(), found->sigma, scale});
    aligned.push_back({then, measurement});
  }
  if (static_cast<int>(ties.size()) < options_.map.lasting_points) return;
  refine(features.camera, aligned, motion.T_current_reference);

  // What the map lost since then, it lost as a whole: the adjustment would take so large an offset for outliers.
  constexpr double kSignificant = 16.8;  // chi-square of six, 99 %
  const Eigen::Isometry3d T_camera_origin = motion.T_current_reference * old->T_camera_origin;
  const Vector6d offset = logSE3(T_camera_origin * map.newestPose().inverse());
  if (offset.dot(motion.covariance.ldlt().solve(offset)) > kSignificant) map.moveTo(T_camera_origin);
  map.recall(*old, ties);
}

/// A motion between two reported poses contains what the map has learnt of the first one meanwhile. Where that is more
/// than its covariance says, the covariance says so and the reason, too.
void VisualOdometry::cover(Step& step) {
  constexpr double kExpected = 12.6;  // chi-square of six, 95 %
  if (step.correction.dot(step.covariance.ldlt().solve(step.correction)) <= kExpected) return;
  step.covariance += step.correction * step.correction.transpose();
  std::ostringstream reason;
  reason << "the map corrected the pose by " << step.correction.head<3>().norm() << " m and "
         << step.correction.tail<3>().norm() << " rad";
  step.reason = reason.str();
}

/// How far a doubtful motion may be off: as far as the hypothesis that speaks against it, or else as what was
/// predicted; and as far as the adjustment moved it.
Matrix6d VisualOdometry::doubt(const Localisation& found, const Eigen::Isometry3d& T_previous_measured,
                               const Eigen::Isometry3d& T_previous_current, double dt) const {
  const Matrix6d moved = disagreement(T_previous_current, T_previous_measured);
  if (found.T_current_reference_else) {
    // Both hypotheses start from the same pair of the map.
    const Eigen::Isometry3d T_else_found = found.motion.T_current_reference * found.T_current_reference_else->inverse();
    return moved + disagreement(Eigen::Isometry3d::Identity(), T_else_found);
  }
  const Eigen::Isometry3d predicted = expSE3(state_.velocity.value_or(Vector6d::Zero()) * dt);
  return moved + disagreement(T_previous_current, predicted) + predictionCovariance(dt);
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
  step.covariance = predictionCovariance(dt);
  state_.covariance.advance(*step.T_previous_current, step.covariance);
  return step;
}

void VisualOdometry::move(const Eigen::Isometry3d& T_previous_current) {
  state_.T_origin_camera = orthonormalised(state_.T_origin_camera * T_previous_current);
  state_.distance += T_previous_current.translation().norm();
}

OdometryResult VisualOdometry::report(const StereoFeatures& features, double dt, const Localisation& found,
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
  }
  if (step.T_previous_current) {
    result.has_motion = true;
    result.T_previous_current = *step.T_previous_current;
    result.motion_covariance = step.covariance;
    result.correction = step.correction;
  }

  for (const FeatureMatch& match : found.matches) {
    const cv::Point3f& previous = found.view.pixels[match.reference];
    result.flow.push_back({previous.x, previous.y, match.current, false});
  }
  const std::vector<int>& rejected = step.rejected_rows;
  for (const int i : found.motion.inliers) {
    FeatureFlow& flow = result.flow[i];
    flow.inlier = std::find(rejected.begin(), rejected.end(), flow.current) == rejected.end();
  }
  const std::vector<int> inliers = inlierRows(found.matches, found.motion.inliers, rejected);
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

/// A camera that repeats its images seems to stand. Whether it does, the motion before tells: where that would have
/// moved the points, only the images stood still.
bool VisualOdometry::isFrozen(const StereoFeatures& features, double dt) const {
  constexpr double kSeen = 1.0;  // px
  if (features.count() == 0 || state_.image[0] != features.u || state_.image[1] != features.v ||
      state_.image[2] != features.disparity)
    return false;
  if (state_.frozen) return true;
  if (!state_.velocity) return false;
  const Eigen::Isometry3d T_current_previous = expSE3(*state_.velocity * -dt);
  int moved = 0;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector3d point = features.camera.backProject(features.u[i], features.v[i], features.disparity[i]);
    const Eigen::Vector3d now = features.camera.project(T_current_previous * point);
    moved += std::hypot(now.x() - features.u[i], now.y() - features.v[i]) > kSeen;
  }
  return 2 * moved > features.count();
}

}  // namespace sdvo
