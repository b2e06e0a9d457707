#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bitset>
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

/// Covariance that a discontinuity of unknown size adds to the pose: metres and a good part of a right angle.
Matrix6d discontinuityCovariance() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(100.0), Eigen::Vector3d::Constant(0.25);
  return variance.asDiagonal();
}

double inlierCoverage(const StereoFeatures& features, const std::vector<FeatureMatch>& inliers) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  for (const FeatureMatch& match : inliers) {
    const int column = static_cast<int>(features.u[match.current] * kColumns / features.camera.width);
    const int row = static_cast<int>(features.v[match.current] * kRows / features.camera.height);
    cells.set(static_cast<std::size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)));
  }
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

/// The nearest positive semi-definite matrix to a symmetric one.
Matrix6d positivePart(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() * solver.eigenvectors().transpose();
}

/// Takes out the matches to rows of the newest pair that the adjustment did not confirm.
void dropMatches(const std::vector<int>& rows, std::vector<FeatureMatch>& matches) {
  const auto dropped = [&](const FeatureMatch& match) {
    return std::find(rows.begin(), rows.end(), match.current) != rows.end();
  };
  matches.erase(std::remove_if(matches.begin(), matches.end(), dropped), matches.end());
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
  state_.predicted_pairs = options_.tracking.max_predicted_pairs;
}

OdometryResult VisualOdometry::update(const StereoFeatures& features) {
  features.check();
  if (state_.last_stamp && features.stamp <= *state_.last_stamp)
    throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                std::to_string(*state_.last_stamp) + " ns");
  if (state_.map && !state_.map->continuedBy(features)) breakStream();

  OdometryResult result;
  result.stamp = features.stamp;
  result.features = features.count();
  result.dt = state_.last_stamp ? static_cast<double>(features.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  state_.last_stamp = features.stamp;
  ++state_.pairs;
  state_.right_rotation.add(features);

  result = state_.map ? follow(std::move(result), features) : seed(std::move(result), features);
  result.epoch = epoch_;
  result.distance = state_.distance;
  reportCalibration(result);
  if (result.has_pose) {
    result.T_origin_camera = state_.T_origin_camera;
    result.pose_covariance = state_.pose_covariance;
  }
  return result;
}

OdometryResult VisualOdometry::seed(OdometryResult result, const StereoFeatures& features) {
  if (features.count() < options_.motion.min_inliers) {
    result.state = state_.started ? TrackingState::kLost : TrackingState::kWaiting;
    result.reason = "only " + std::to_string(features.count()) + " features" +
                    (features.report.status.empty() ? "" : ": " + features.report.status);
    return result;
  }
  if (state_.started) {
    ++epoch_;
    state_.pose_covariance += discontinuityCovariance();
    result.state = TrackingState::kDegraded;
    result.reason = "started again from the last pose; the motion in between is unknown";
  } else {
    result.state = TrackingState::kTracking;
    result.reason = "first pair";
  }
  state_.started = true;
  state_.predicted_pairs = 0;
  state_.map.emplace(options_.map);
  state_.map->insert(features, state_.pairs, state_.T_origin_camera.inverse(), {}, state_.calibration.calibration());
  noteKeyframe();
  result.keyframe_id = state_.pairs;
  result.has_pose = true;
  return result;
}

OdometryResult VisualOdometry::follow(OdometryResult result, const StereoFeatures& features) {
  // The motion since the map's newest pair: what was already covered by predicted pairs, and the velocity from there
  // on.
  std::optional<Eigen::Isometry3d> prior;
  if (state_.velocity && result.dt <= options_.tracking.max_gap) {
    const Eigen::Isometry3d T_origin_predicted = state_.T_origin_camera * expSE3(*state_.velocity * result.dt);
    prior = (state_.map->newestPose() * T_origin_predicted).inverse();
  }
  result.reference_id = state_.map->newestId();

  Localisation found = localise(features, prior, result);
  const auto since_previous = [&] {
    const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * state_.map->newestPose();
    return Eigen::Isometry3d((T_camera_origin * state_.T_origin_camera).inverse());
  };
  std::string reason = found.motion.success ? implausible(since_previous(), result.dt) : found.motion.reason;
  if (!reason.empty() && prior) {
    // The prior itself may be what misled the search.
    found = localise(features, std::nullopt, result);
    reason = found.motion.success ? implausible(since_previous(), result.dt) : found.motion.reason;
  }
  if (!reason.empty()) {
    result.inlier_matches.clear();
    for (FeatureFlow& flow : result.flow) flow.inlier = false;
    result.reason = reason + (features.report.status.empty() ? "" : "; " + features.report.status);
    return predict(std::move(result));
  }

  result.state = TrackingState::kTracking;
  const double since_reference = static_cast<double>(features.stamp - state_.map->newestStamp()) * 1e-9;
  state_.velocity = logSE3(found.motion.T_current_reference.inverse()) / since_reference;
  extendMap(features, found, result);
  state_.predicted_pairs = 0;
  return result;
}

VisualOdometry::Localisation VisualOdometry::localise(const StereoFeatures& features,
                                                      const std::optional<Eigen::Isometry3d>& prior,
                                                      OdometryResult& result) const {
  Localisation found;
  found.view = state_.map->view();
  const StereoFeatures& reference = found.view.features;
  Stopwatch stopwatch;
  const std::vector<FeatureMatch> matches = matcher_.match(reference, features, prior);
  result.matches = static_cast<int>(matches.size());
  result.match_time += stopwatch.lap();

  std::vector<Correspondence> correspondences;
  correspondences.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    Eigen::Vector3d measurement = features.measurement(match.current);
    measurement.z() += state_.calibration.calibration().disparityError(features.camera, measurement.x());
    correspondences.push_back({reference.point(match.reference), measurement});
  }
  found.motion = estimator_.estimate(features.camera, correspondences);
  result.motion_time += stopwatch.lap();

  result.flow.clear();
  for (const FeatureMatch& match : matches)
    result.flow.push_back({reference.u[match.reference], reference.v[match.reference], match.current, false});
  result.inlier_matches.clear();
  for (const int i : found.motion.inliers) {
    result.flow[i].inlier = true;
    found.inliers.push_back(matches[i]);
    const int row_of_newest = found.view.row_of_newest[matches[i].reference];
    result.inlier_matches.push_back({row_of_newest, matches[i].current, matches[i].distance});
  }
  result.inliers = static_cast<int>(found.inliers.size());
  result.coverage = inlierCoverage(features, found.inliers);
  result.rms = found.motion.rms;
  return found;
}

void VisualOdometry::extendMap(const StereoFeatures& features, const Localisation& found, OdometryResult& result) {
  Stopwatch stopwatch;
  LocalMap& map = *state_.map;
  std::vector<LocalMap::Sighting> sightings;
  for (const FeatureMatch& match : found.inliers)
    sightings.push_back({found.view.point[match.reference], match.current});
  RigCalibration calibration = state_.calibration.calibration();
  map.insert(features, state_.pairs, found.motion.T_current_reference * map.newestPose(), sightings, calibration);
  const CalibrationBelief prior = state_.calibration.prior(map.oldestId());
  const LocalMap::Adjustment adjustment = map.adjust(options_.window, prior, calibration);
  result.window_frames = adjustment.frames;

  const Eigen::Isometry3d T_previous_current = (map.newestPose() * state_.T_origin_camera).inverse();
  if (!adjustment.success) {
    advance(result, T_previous_current, found.motion.covariance);
  } else {
    state_.calibration.note(map.newestId(), calibration, adjustment.calibration_information);
    dropMatches(adjustment.rejected_rows, result.inlier_matches);
    result.inliers = static_cast<int>(result.inlier_matches.size());
    // The key frame is common to this pair and to the pairs since: uncertainty grows from there, not from pair to pair.
    // The previous pose was reported before this pair improved it; what it then lacked is in the reported motion as
    // well.
    const LocalMap::Adjustment& last = state_.last_adjustment;
    const Matrix6d& then = map.oldestId() == state_.last_oldest_id ? last.since_first : last.since_second;
    const Matrix6d outdated = state_.previous_is_keyframe ? positivePart(then - adjustment.keyframe_since_first)
                                                          : state_.covariance_since_keyframe;
    const Matrix6d carried = adjoint(T_previous_current.inverse());
    const Matrix6d& since_keyframe = adjustment.since_keyframe;
    const Matrix6d before = carried * state_.pose_covariance * carried.transpose();
    advance(result, T_previous_current, carried * outdated * carried.transpose() + since_keyframe);
    const Matrix6d from_keyframe = adjoint(state_.T_origin_camera.inverse() * state_.T_origin_keyframe);
    const Matrix6d measured = from_keyframe * state_.keyframe_covariance * from_keyframe.transpose() + since_keyframe;
    // What was published stays true: within an epoch the covariance does not shrink, not even after a predicted pair.
    state_.pose_covariance = measured.trace() >= before.trace() ? measured : before;
    state_.covariance_since_keyframe = since_keyframe;
    state_.last_adjustment = adjustment;
    state_.last_oldest_id = map.oldestId();
  }
  state_.previous_is_keyframe = false;
  if (map.newestIsKeyframe()) noteKeyframe();
  result.keyframe_id = map.lastKeyframeId();
  result.motion_time += stopwatch.lap();
}

void VisualOdometry::noteKeyframe() {
  state_.T_origin_keyframe = state_.T_origin_camera;
  state_.keyframe_covariance = state_.pose_covariance;
  state_.covariance_since_keyframe.setZero();
  state_.previous_is_keyframe = true;
}

void VisualOdometry::reportCalibration(OdometryResult& result) const {
  const RigCalibration::Vector sigma = state_.calibration.sigma();
  if (sigma.allFinite()) {
    result.disparity_offset = state_.calibration.calibration().value[0];
    result.disparity_bend = state_.calibration.calibration().value[1];
    result.disparity_offset_sigma = sigma[0];
    result.disparity_bend_sigma = sigma[1];
  }
  result.right_rotation = state_.right_rotation.rotation();
  result.right_rotation_sigma = state_.right_rotation.sigma();
}

OdometryResult VisualOdometry::predict(OdometryResult result) {
  const bool can_predict = state_.velocity && result.dt <= options_.tracking.max_gap &&
                           state_.predicted_pairs < options_.tracking.max_predicted_pairs;
  if (!can_predict) {
    state_.map.reset();
    state_.velocity.reset();
    result.state = TrackingState::kLost;
    return result;
  }
  ++state_.predicted_pairs;
  state_.previous_is_keyframe = false;
  result.state = TrackingState::kDegraded;
  result.reason = "motion predicted: " + result.reason;
  advance(result, expSE3(*state_.velocity * result.dt), predictionCovariance(result.dt));
  return result;
}

void VisualOdometry::advance(OdometryResult& result, const Eigen::Isometry3d& T_previous_current,
                             const Matrix6d& covariance) {
  result.has_pose = result.has_motion = true;
  result.T_previous_current = T_previous_current;
  result.motion_covariance = covariance;
  const Matrix6d carried = adjoint(T_previous_current.inverse());
  state_.pose_covariance = carried * state_.pose_covariance * carried.transpose() + covariance;
  state_.covariance_since_keyframe = carried * state_.covariance_since_keyframe * carried.transpose() + covariance;
  state_.T_origin_camera = orthonormalised(state_.T_origin_camera * T_previous_current);
  state_.distance += T_previous_current.translation().norm();
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
