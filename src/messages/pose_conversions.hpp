#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>

#include <Eigen/Geometry>
#include <string>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::ros_conversions {

/// T_body_optical at one place: a body's axes are x ahead, y left, z up, an optical frame's x right, y down, z ahead.
Eigen::Isometry3d bodyToOptical();

/// A pose of six numbers, "x y z roll pitch yaw" (m, rad; about the fixed axes x, y and z in this order, as in URDF).
/// Throws std::invalid_argument when it is none.
Eigen::Isometry3d toPose(const std::string& text);

/// Throws std::invalid_argument when the position is not finite or the quaternion has not unit length.
Eigen::Isometry3d toPose(const geometry_msgs::Pose& message);

/// Converts a covariance of a right perturbation to ROS' convention: position and rotation in the fixed axes of the
/// parent frame.
geometry_msgs::PoseWithCovariance toMessage(const Eigen::Isometry3d& pose, const Matrix6d& covariance);
/// Accepts covariances of other senders: with one empty triangle, and with variances of zero (z, roll and pitch of rviz
/// and AMCL), which become 1e-6 (1 mm, 1 mrad). Throws std::invalid_argument with a remedy for invalid ones.
void fromMessage(const geometry_msgs::PoseWithCovariance& message, Eigen::Isometry3d& pose, Matrix6d& covariance);

}  // namespace sdvo::ros_conversions
