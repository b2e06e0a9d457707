#pragma once

#include <Eigen/Geometry>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

/// What a vehicle's acceleration does not exceed for longer than a moment.
constexpr double kLastingAcceleration = 5.0;      // m/s^2
constexpr double kLastingTurnAcceleration = 2.0;  // rad/s^2

/// Covariances, of right perturbations in m and rad, of motions that were not measured or not for certain.

/// Uncertainty that a prediction adds to the velocity it starts from, `dt` in s. The mean velocities of two intervals of
/// `dt` differ by the acceleration above times `dt`, so the motions differ by that times `dt` once more.
Matrix6d predictionCovariance(double dt);

/// What could have been travelled unseen, by a vehicle that went on with its velocity, m/s and rad/s, and accelerated
/// as above; it is never faster than `max_speed`, m/s.
Matrix6d travelCovariance(const Vector6d& velocity, double seconds, double max_speed);

/// As large in every direction as two motions differ.
Matrix6d disagreement(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

}  // namespace sdvo
