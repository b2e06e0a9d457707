#pragma once

#include <string>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/odometry_state.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry_options.hpp"

namespace sdvo {

constexpr const char* kStartedAgain = "started again from the last pose; the motion in between is unknown";

/// The pair begins a map: the first one, or where the guesses have the camera, or at the last pose. While there is a
/// map from before, the odometry is lost until the next pair is found in either.
OdometryStep startMap(const VisualOdometryOptions& options, const StereoFeatures& features, OdometryState& state);

/// Images that repeat themselves show no motion: the pose stays, as uncertain as the prior makes it meanwhile.
OdometryStep holdPose(double dt, OdometryState& state);

/// The motion by the guess or by the velocity; without them the odometry is lost. `failure`: why it is not measured.
OdometryStep predictMotion(const VisualOdometryOptions& options, const StereoFeatures& features, double dt,
                           const std::string& failure, OdometryState& state);

}  // namespace sdvo
