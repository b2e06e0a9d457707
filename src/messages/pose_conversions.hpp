#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>

#include <Eigen/Geometry>
#include <string>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::ros_conversions {

/// A pose of six numbers, "x y z roll pitch yaw" (m, rad; about the fixed axes x, y and z in this order, as in URDF).
/// Throws std::invalid_argument when it is none.
Eigen::Isometry3d toPose(const std::string& text);

/// Throws std::invalid_argument when the position is not finite or the quaternion has not unit length.
Eigen::Isometry3d toPose(const geometry_msgs::Pose& message);

/// ROS' convention: covariance of the position, and of the rotation about the fixed axes, of the parent's frame. The
/// core's is that of a right perturbation.
geometry_msgs::PoseWithCovariance toMessage(const Eigen::Isometry3d& pose, const Matrix6d& covariance);
/// Covariances as others send them: one triangle may be left empty, and a variance of zero, as rviz and AMCL have it
/// for z, roll and pitch, is 1e-6 (1 mm, 1 mrad). Throws std::invalid_argument, which says what to change, for the
/// rest.
void fromMessage(const geometry_msgs::PoseWithCovariance& message, Eigen::Isometry3d& pose, Matrix6d& covariance);

}  // namespace sdvo::ros_conversions
