#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bitset>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "stereo_descriptor_vo/common/stopwatch.hpp"

namespace sdvo {
namespace {

/// How much less a predicted motion is known than a measured one: constant velocity errs by the acceleration, for which
/// a vehicle's 5 m/s^2 and 2 rad/s^2 stand.
Matrix6d predictionCovariance(double dt) {
  const double translation = 0.5 * 5.0 * dt * dt, rotation = 0.5 * 2.0 * dt * dt;
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation * translation), Eigen::Vector3d::Constant(rotation * rotation);
  return variance.asDiagonal();
}

int countInliers(const std::vector<FeatureFlow>& flow) {
  return static_cast<int>(std::count_if(flow.begin(), flow.end(), [](const FeatureFlow& f) { return f.inlier; }));
}

/// Share of the cells over the image that hold an inlier.
double coverage(const StereoFeatures& features, const std::vector<FeatureFlow>& flow) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  for (const FeatureFlow& match : flow) {
    if (!match.inlier) continue;
    const int column = static_cast<int>(features.u[match.current] * kColumns / features.camera.width);
    const int row = static_cast<int>(features.v[match.current] * kRows / features.camera.height);
    cells.set(static_cast<std::size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)));
  }
  return static_cast<double>(cells.count()) / (kColumns * kRows);
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
  Localisation found = continued ? localise(features, dt) : Localisation{};
  if (continued && found.failure.empty()) align(features, found);

  // Nothing has changed so far, and from here on nothing is refused.
  Stopwatch stopwatch;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  state_.right_rotation.add(features);
  Step step;
  if (!continued)
    step = seed(features);
  else if (found.failure.empty())
    step = extendMap(features, found);
  else
    step = predict(features, dt, found.failure);
  if (step.T_previous_current) move(*step.T_previous_current);
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
  if (!state_.velocity || dt > options_.tracking.max_gap) return search(features, std::nullopt, dt);
  // The motion since the map's newest pair: what was already covered by predicted pairs, and the velocity from there
  // on.
  const Eigen::Isometry3d T_origin_predicted = state_.T_origin_camera * expSE3(*state_.velocity * dt);
  Localisation found = search(features, (state_.map->newestPose() * T_origin_predicted).inverse(), dt);
  if (found.failure.empty()) return found;
  // The prior itself may be what misled the search.
  Localisation without_prior = search(features, std::nullopt, dt);
  without_prior.match_time += found.match_time;
  without_prior.motion_time += found.motion_time;
  return without_prior;
}

VisualOdometry::Localisation VisualOdometry::search(const StereoFeatures& features,
                                                    const std::optional<Eigen::Isometry3d>& T_current_reference,
                                                    double dt) const {
  Localisation found;
  found.view = state_.map->view();
  Stopwatch stopwatch;
  found.matches = matcher_.match(found.view.rows, features, T_current_reference);
  found.match_time = stopwatch.lap();
  found.motion = estimate(found.view.rows, features, found.matches);
  const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * state_.map->newestPose();
  found.failure = found.motion.success ? implausible((T_camera_origin * state_.T_origin_camera).inverse(), dt)
                                       : found.motion.reason;
  found.motion_time = stopwatch.lap();
  return found;
}

/// (u_left, v_left, u_right) of a feature whose position is known better by `shift`, px, without the rig's error.
Eigen::Vector3d VisualOdometry::measure(const StereoFeatures& features, int row, const Eigen::Vector2d& shift) const {
  const double u = features.u[row] + shift.x(), v = features.v[row] + shift.y();
  const double error = state_.calibration.calibration().disparityError(features.camera, u);
  return {u, v, u - (features.disparity[row] - error)};
}

MotionEstimate VisualOdometry::estimate(const DescribedPoints& reference, const StereoFeatures& features,
                                        const std::vector<FeatureMatch>& matches) const {
  std::vector<Correspondence> correspondences;
  correspondences.reserve(matches.size());
  for (const FeatureMatch& match : matches)
    correspondences.push_back(
        {reference.positions[match.reference], measure(features, match.current, Eigen::Vector2d::Zero())});
  return estimator_.estimate(features.camera, correspondences);
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
    state_.covariance.restart();
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

VisualOdometry::Step VisualOdometry::extendMap(const StereoFeatures& features, const Localisation& found) {
  LocalMap& map = *state_.map;
  const double since_newest = static_cast<double>(features.stamp - map.newestStamp()) * 1e-9;
  state_.velocity = logSE3(found.motion.T_current_reference.inverse()) / since_newest;
  state_.predicted_pairs = 0;

  RigCalibration calibration = state_.calibration.calibration();
  map.insert(features, state_.pairs, found.motion.T_current_reference * map.newestPose(), found.sightings, calibration);
  const Eigen::Isometry3d T_before_origin = map.poseBeforeNewest();
  if (map.newestIsKeyframe()) recall(features);
  const CalibrationBelief prior = state_.calibration.prior(map.oldestId());
  const LocalMap::Adjustment adjustment = map.adjust(options_.window, prior, calibration);
  map.renewLooks(features, found.sightings);

  Step step;
  step.state = TrackingState::kTracking;
  step.T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  if (adjustment.success) {
    state_.calibration.note(map.newestId(), calibration, adjustment.calibration_information);
    step.covariance = state_.covariance.advance(*step.T_previous_current, adjustment.covariances);
    step.rejected_rows = adjustment.rejected_rows;
    // As a perturbation of the frame before, then of the newest one.
    step.correction = adjoint(map.newestPose() * map.poseBeforeNewest().inverse()) *
                      logSE3(T_before_origin * map.poseBeforeNewest().inverse());
    cover(step);
  } else {
    step.covariance = found.motion.covariance;
    state_.covariance.advance(*step.T_previous_current, step.covariance);
  }
  if (map.newestIsKeyframe()) state_.covariance.markKeyframe();
  return step;
}

/// A camera that comes back to where it was before is tied to the key frame that it left there.
void VisualOdometry::recall(const StereoFeatures& features) {
  LocalMap& map = *state_.map;
  const OldKeyframe* old = map.revisited();
  if (!old) return;
  const auto matches = matcher_.match(old->rows, features, map.newestPose() * old->T_camera_origin.inverse());
  MotionEstimate motion = estimate(old->rows, features, matches);
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
  result.features = features.count();
  result.matches = static_cast<int>(found.matches.size());
  result.inliers = countInliers(result.flow);
  result.coverage = coverage(features, result.flow);
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

std::string VisualOdometry::implausible(const Eigen::Isometry3d& T_previous_current, double dt) const {
  const double speed = T_previous_current.translation().norm() / dt;
  const double rate = logSO3(T_previous_current.linear()).norm() / dt;
  std::ostringstream reason;
  if (speed > options_.tracking.max_speed)
    reason << "a speed of " << speed << " m/s exceeds tracking/max_speed";
  else if (rate > options_.tracking.max_rotation_rate)
    reason << "a rotation of " << rate << " rad/s exceeds tracking/max_rotation_rate";
  return reason.str();
}

}  // namespace sdvo
