#pragma once

#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "../belief/belief.hpp"
#include "../map/floor.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/odometry/odometry_result.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

struct MapUpdate;
struct OdometryState;
struct SearchedPair;

/// A pair's state, and its motion since the last pose.
struct OdometryStep {
  TrackingState state = TrackingState::kWaiting;
  std::string reason;
  double probability = std::numeric_limits<double>::quiet_NaN();  ///< that a measured motion is the camera's
  std::optional<Eigen::Isometry3d> T_previous_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of that motion
  Vector6d correction = Vector6d::Zero();  ///< see OdometryResult
  std::vector<int> rejected_features;      ///< matched features of the pair that the adjustment does not confirm
  double dt = 0.0;                         ///< see OdometryResult, s
  double time = 0.0;                       ///< of computation, s
  bool changes_epoch = false;              ///< the motion is not since the last reported pose

  bool hasPose() const { return state == TrackingState::kTracking || state == TrackingState::kDegraded; }
};

// Each step changes the state. The pair with a measured motion: measured_step.cpp.

/// The pair joins the map.
OdometryStep measuredStep(const VisualOdometryOptions& options, const std::optional<Floor>& floor,
                          const SearchedPair& pair, const MapUpdate& update, const std::vector<Evidence>& evidence,
                          OdometryState& state);

// Pairs without one: unmeasured_step.cpp.

constexpr const char* kStartedAgain = "started again from the last pose; the motion in between is unknown";

/// Begins a map with the pair: the first one, or at the guesses' pose, or at the last pose. While there is a map from
/// before the outage, the odometry is lost until the next pair is found in either.
OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state);

/// Repeated images contain no motion: the pose stays, and the possible motion widens its covariance.
OdometryStep holdPose(double dt, OdometryState& state);

/// Moves the pose by the guess or the velocity, else the odometry is lost. `failure`: why no motion is measured.
OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state);

}  // namespace sdvo
