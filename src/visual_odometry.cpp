#include "stereo_descriptor_vo/visual_odometry.hpp"

#include <algorithm>
#include <bitset>
#include <sstream>
#include <stdexcept>

#include "stereo_descriptor_vo/stopwatch.hpp"

namespace sdvo {
namespace {

/// How much less a predicted motion is known than a measured one: constant velocity errs by the acceleration, for which a
/// vehicle's 5 m/s^2 and 2 rad/s^2 stand.
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

}  // namespace

const char* toString(TrackingState state) {
  switch (state) {
    case TrackingState::kWaiting: return "WAITING";
    case TrackingState::kTracking: return "TRACKING";
    case TrackingState::kDegraded: return "DEGRADED";
    case TrackingState::kLost: return "LOST";
  }
  return "UNKNOWN";
}

VisualOdometry::VisualOdometry(const VisualOdometryOptions& options)
    : options_(checked(options)), matcher_(options.matcher), estimator_(options.motion) {}

void VisualOdometry::reset() {
  state_ = State{};
  ++epoch_;
}

void VisualOdometry::breakStream() {
  state_.reference.reset();
  state_.velocity.reset();
  state_.predicted_pairs = options_.tracking.max_predicted_pairs;
}

OdometryResult VisualOdometry::update(const StereoFeatures& features) {
  features.check();
  if (state_.last_stamp && features.stamp <= *state_.last_stamp)
    throw std::invalid_argument("stamp " + std::to_string(features.stamp) + " ns is not later than the last one, " +
                                std::to_string(*state_.last_stamp) + " ns");
  if (state_.reference) {
    const StereoFeatures& last = state_.reference->features;
    if (last.camera != features.camera ||
        (features.count() > 0 && (last.descriptor != features.descriptor || last.layout != features.layout ||
                                  last.descriptors.cols != features.descriptors.cols)))
      breakStream();
  }

  OdometryResult result;
  result.stamp = features.stamp;
  result.features = features.count();
  result.dt = state_.last_stamp ? static_cast<double>(features.stamp - *state_.last_stamp) * 1e-9 : 0.0;
  state_.last_stamp = features.stamp;
  ++state_.pairs;

  result = state_.reference ? follow(std::move(result), features) : seed(std::move(result), features);
  result.epoch = epoch_;
  result.distance = state_.distance;
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
  state_.reference = Reference{features, state_.T_origin_camera, state_.pairs};
  result.has_pose = true;
  return result;
}

OdometryResult VisualOdometry::follow(OdometryResult result, const StereoFeatures& features) {
  // The motion since the reference: what was already covered by predicted pairs, and the velocity from there on.
  std::optional<Eigen::Isometry3d> prior;
  if (state_.velocity && result.dt <= options_.tracking.max_gap) {
    const Eigen::Isometry3d T_origin_predicted = state_.T_origin_camera * expSE3(*state_.velocity * result.dt);
    prior = T_origin_predicted.inverse() * state_.reference->T_origin_camera;
  }
  result.reference_id = state_.reference->id;

  MotionEstimate motion = estimateMotion(features, prior, result);
  const auto since_previous = [&] {
    const Eigen::Isometry3d T_origin_current =
        state_.reference->T_origin_camera * motion.T_current_reference.inverse();
    return Eigen::Isometry3d(state_.T_origin_camera.inverse() * T_origin_current);
  };
  std::string reason = motion.success ? implausible(since_previous(), result.dt) : motion.reason;
  if (!reason.empty() && prior) {
    // The prior itself may be what misled the search.
    motion = estimateMotion(features, std::nullopt, result);
    reason = motion.success ? implausible(since_previous(), result.dt) : motion.reason;
  }
  if (!reason.empty()) {
    result.inlier_matches.clear();
    result.reason = reason + (features.report.status.empty() ? "" : "; " + features.report.status);
    return predict(std::move(result));
  }

  result.state = TrackingState::kTracking;
  advance(result, since_previous(), motion.covariance);
  const double since_reference = static_cast<double>(features.stamp - state_.reference->features.stamp) * 1e-9;
  state_.velocity = logSE3(motion.T_current_reference.inverse()) / since_reference;
  state_.predicted_pairs = 0;
  state_.reference = Reference{features, state_.T_origin_camera, state_.pairs};
  return result;
}

MotionEstimate VisualOdometry::estimateMotion(const StereoFeatures& features,
                                              const std::optional<Eigen::Isometry3d>& prior,
                                              OdometryResult& result) const {
  const StereoFeatures& reference = state_.reference->features;
  Stopwatch stopwatch;
  const std::vector<FeatureMatch> matches = matcher_.match(reference, features, prior);
  result.matches = static_cast<int>(matches.size());
  result.match_time += stopwatch.lap();

  std::vector<Correspondence> correspondences;
  correspondences.reserve(matches.size());
  for (const FeatureMatch& match : matches)
    correspondences.push_back({reference.point(match.reference), features.measurement(match.current)});
  MotionEstimate motion = estimator_.estimate(features.camera, correspondences);
  result.motion_time += stopwatch.lap();

  result.inlier_matches.clear();
  for (const int i : motion.inliers) result.inlier_matches.push_back(matches[i]);
  result.inliers = static_cast<int>(motion.inliers.size());
  result.coverage = inlierCoverage(features, result.inlier_matches);
  result.rms = motion.rms;
  return motion;
}

OdometryResult VisualOdometry::predict(OdometryResult result) {
  const bool can_predict = state_.velocity && result.dt <= options_.tracking.max_gap &&
                           state_.predicted_pairs < options_.tracking.max_predicted_pairs;
  if (!can_predict) {
    state_.reference.reset();
    state_.velocity.reset();
    result.state = TrackingState::kLost;
    return result;
  }
  ++state_.predicted_pairs;
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
