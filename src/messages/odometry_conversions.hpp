#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/PointCloud2.h>
#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "frames.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::ros_conversions {

/// Pose of the base in odom, twist in the base frame, both covariances in ROS' conventions (row-major, translation
/// first, rotation about the fixed axes of the frame). `result` must have a pose. `T_odom_start`: the base's first
/// pose.
nav_msgs::Odometry toOdometry(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
                              const OdometryFrames& frames,
                              const Eigen::Isometry3d& T_odom_start = Eigen::Isometry3d::Identity());

/// Odometry of a lost robot, as rtabmap sends it: pose (with the quaternion) and twist are zeros, variances are 9999.
nav_msgs::Odometry toNullOdometry(const ros::Time& stamp, const OdometryFrames& frames);

/// Inverse of toOdometry(): covariance of the camera's motion since the previous pair, `dt` s ago, as a right
/// perturbation (m, rad). Throws std::invalid_argument if the twist's covariance is not finite.
Matrix6d toMotionCovariance(const nav_msgs::Odometry& odometry, double dt, const Eigen::Isometry3d& T_base_camera);

/// The transform of an odometry message: odom -> base, or base -> odom when inverted.
geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry, bool inverted);

/// From the result and the image side's message; the caller fills in header, latency and counters of unused input.
stereo_descriptor_vo::VoInfo toInfo(const OdometryResult& result, const stereo_descriptor_vo::StereoFeatures& features);

/// Current and previous positions of the matched features; the caller fills in the header.
stereo_descriptor_vo::FeatureFlow toFlow(const OdometryResult& result, const StereoFeatures& features);

/// A cloud of points that are given in another frame, such as the local map's; the caller fills in the header.
sensor_msgs::PointCloud2 toPointCloud(const std::vector<Eigen::Vector3d>& points,
                                      const Eigen::Isometry3d& T_cloud_points);

}  // namespace sdvo::ros_conversions
