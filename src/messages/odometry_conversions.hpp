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

/// What says that there is no odometry, as rtabmap does: pose and twist all zeros, the quaternion too, and variances of
/// 9999.
nav_msgs::Odometry toNullOdometry(const ros::Time& stamp, const OdometryFrames& frames);

/// What toOdometry() was given as the covariance of the camera's motion since the pair before, `dt` s ago: of its right
/// perturbation, m and rad. Throws std::invalid_argument where a number of the twist's covariance is not finite.
Matrix6d toMotionCovariance(const nav_msgs::Odometry& odometry, double dt, const Eigen::Isometry3d& T_base_camera);

/// The transform of an odometry message: odom -> base, or base -> odom when inverted.
geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry, bool inverted);

/// What the result and the image side tell; header, latency and input counters are the caller's to fill.
stereo_descriptor_vo::VoInfo toInfo(const OdometryResult& result, const stereo_descriptor_vo::StereoFeatures& features);

/// Where the matched features of a pair were before; header is the caller's to fill.
stereo_descriptor_vo::FeatureFlow toFlow(const OdometryResult& result, const StereoFeatures& features);

/// Points given in another frame, such as the local map's; header is the caller's to fill.
sensor_msgs::PointCloud2 toPointCloud(const std::vector<Eigen::Vector3d>& points,
                                      const Eigen::Isometry3d& T_cloud_points);

}  // namespace sdvo::ros_conversions
