#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <stereo_descriptor_vo/FeatureFlow.h>
#include <stereo_descriptor_vo/StereoFeatures.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <opencv2/core.hpp>
#include <string>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/front_end/depth_scale.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

/// Where messages and core types meet; those of places do in place_conversions.
namespace sdvo::ros_conversions {

/// Frame id as tf2 wants it, without a leading slash.
std::string cleanFrameId(const std::string& frame_id);

/// Geometry from the two projection matrices with binning and region of interest applied (REP-104, image_geometry).
/// Throws std::invalid_argument when the cameras are uncalibrated, differ, or the baseline is not positive.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

/// Bits that the brightest pixel needs: 10, 12, 14 or 16 for mono16, as which cameras of any depth send their images; 8
/// for every other encoding and for a dark image. Throws as toGrey() does.
int bitDepth(const sensor_msgs::Image& message);

/// CV_8U grey pixels of mono8, 8UC1, mono16, bgr8, rgb8, bgra8 and rgba8; shares the message's memory where it can, so
/// that the message must outlive the result. `bits`: mono16 only, depth of the pixel that becomes 255.
/// Throws std::invalid_argument for any other encoding and for images whose size and data disagree.
cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, int bits = 16);

/// Header, stream epoch and drop counter are the caller's to fill.
stereo_descriptor_vo::StereoFeatures toMessage(const StereoFeatures& features, const DepthScaleOptions& size_curve);

/// Throws std::invalid_argument when the message does not hold together; the result owns its memory.
StereoFeatures fromMessage(const stereo_descriptor_vo::StereoFeatures& message);

/// Names of the two frames an odometry connects.
struct OdometryFrames {
  std::string odom = "odom";
  std::string base = "base_link";
};

/// Pose of the base in odom, twist in the base frame, both covariances in ROS' conventions (row-major, translation
/// first, rotation about the fixed axes of the frame). `result` must have a pose. `T_odom_start`: the base's first
/// pose.
nav_msgs::Odometry toOdometry(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
                              const OdometryFrames& frames,
                              const Eigen::Isometry3d& T_odom_start = Eigen::Isometry3d::Identity());

/// A pose of six numbers, "x y z roll pitch yaw" (m, rad; about the fixed axes x, y and z in this order, as in URDF).
/// Throws std::invalid_argument when it is none.
Eigen::Isometry3d toPose(const std::string& text);

/// Throws std::invalid_argument when the position is not finite or the quaternion has not unit length.
Eigen::Isometry3d toPose(const geometry_msgs::Pose& message);

/// What toOdometry() was given as the covariance of the camera's motion since the pair before, `dt` s ago: of its right
/// perturbation, m and rad. Throws std::invalid_argument where a number of the twist's covariance is not finite.
Matrix6d toMotionCovariance(const nav_msgs::Odometry& odometry, double dt, const Eigen::Isometry3d& T_base_camera);

/// The transform of an odometry message: odom -> base, or base -> odom when inverted.
geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry, bool inverted);

/// What the result and the image side tell; header, latency and input counters are the caller's to fill.
stereo_descriptor_vo::VoInfo toInfo(const OdometryResult& result, const stereo_descriptor_vo::StereoFeatures& features);

/// Where the matched features of a pair were before; header is the caller's to fill.
stereo_descriptor_vo::FeatureFlow toFlow(const OdometryResult& result, const StereoFeatures& features);

/// The features' points in the left optical frame; fields x, y, z (m) and disparity (px).
sensor_msgs::PointCloud2 toPointCloud(const stereo_descriptor_vo::StereoFeatures& features);

}  // namespace sdvo::ros_conversions
