#include "odometry_conversions.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>

#include "pose_conversions.hpp"

namespace sdvo::ros_conversions {
namespace {

/// Variance of an unknown motion (m²/s², rad²/s²), and the floor that keeps covariances positive definite.
constexpr double kUnknownVariance = 1e6;
constexpr double kVarianceFloor = 1e-9;

/// Only the mean velocity since the previous pair, `dt` s ago, is measured. Variance of the present velocity about it,
/// for a vehicle that accelerates by up to 5 m/s^2 and 2 rad/s^2.
Matrix6d unsteadiness(double dt) {
  constexpr double kSteady = 0.2;  // s
  const double gap = std::max(0.0, dt - kSteady);
  Vector6d deviation;
  deviation << Eigen::Vector3d::Constant(0.5 * 5.0 * gap), Eigen::Vector3d::Constant(0.5 * 2.0 * gap);
  return deviation.cwiseAbs2().asDiagonal();
}

}  // namespace

nav_msgs::Odometry toOdometry(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
                              const OdometryFrames& frames, const Eigen::Isometry3d& T_odom_start) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp.fromNSec(static_cast<std::uint64_t>(result.stamp));
  odometry.header.frame_id = frames.odom;
  odometry.child_frame_id = frames.base;

  // The core's origin is the camera's first pose, T_odom_start the base's.
  const Eigen::Isometry3d T_odom_base =
      orthonormalised(T_odom_start * T_base_camera * result.T_origin_camera * T_base_camera.inverse());
  // Perturbations of the camera, in its own axes, become those of the base.
  const Matrix6d to_base = adjoint(T_base_camera);
  const Matrix6d floor = kVarianceFloor * Matrix6d::Identity();
  odometry.pose = toMessage(T_odom_base, to_base * result.pose_covariance * to_base.transpose() + floor);

  Matrix6d of_twist = kUnknownVariance * Matrix6d::Identity();
  if (result.has_motion && result.dt > 0.0) {
    const Vector6d twist = logSE3(T_base_camera * result.T_previous_current * T_base_camera.inverse()) / result.dt;
    odometry.twist.twist = tf2::toMsg(twist);
    of_twist =
        to_base * result.motion_covariance * to_base.transpose() / (result.dt * result.dt) + unsteadiness(result.dt);
  }
  Eigen::Map<Matrix6d>(odometry.twist.covariance.data()) = 0.5 * (of_twist + of_twist.transpose()) + floor;
  return odometry;
}

nav_msgs::Odometry toNullOdometry(const ros::Time& stamp, const OdometryFrames& frames) {
  constexpr double kNoOdometry = 9999.0;
  nav_msgs::Odometry odometry;
  odometry.header.stamp = stamp;
  odometry.header.frame_id = frames.odom;
  odometry.child_frame_id = frames.base;
  odometry.pose.pose.orientation.w = 0.0;
  for (std::size_t axis = 0; axis < 6; ++axis)
    odometry.pose.covariance[7 * axis] = odometry.twist.covariance[7 * axis] = kNoOdometry;
  return odometry;
}

Matrix6d toMotionCovariance(const nav_msgs::Odometry& odometry, double dt, const Eigen::Isometry3d& T_base_camera) {
  Matrix6d twist = Eigen::Map<const Matrix6d>(odometry.twist.covariance.data()).transpose();  // it has rows
  if (!twist.allFinite()) throw std::invalid_argument("the twist's covariance is not finite");
  const Matrix6d steady = twist - unsteadiness(dt);
  // Another program's odometry may have a covariance without this term: then nothing is subtracted.
  if (steady.llt().info() == Eigen::Success) twist = steady;
  const Matrix6d to_camera = adjoint(T_base_camera.inverse());
  return to_camera * twist * to_camera.transpose() * dt * dt;
}

geometry_msgs::TransformStamped toTransform(const nav_msgs::Odometry& odometry, bool inverted) {
  Eigen::Isometry3d T_odom_base;
  tf2::fromMsg(odometry.pose.pose, T_odom_base);
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(inverted ? T_odom_base.inverse() : T_odom_base);
  transform.header = odometry.header;
  transform.child_frame_id = odometry.child_frame_id;
  if (inverted) std::swap(transform.header.frame_id, transform.child_frame_id);
  return transform;
}

// The constants of the message are the values of the enum.
static_assert(static_cast<int>(TrackingState::kWaiting) == stereo_descriptor_vo::VoInfo::WAITING);
static_assert(static_cast<int>(TrackingState::kTracking) == stereo_descriptor_vo::VoInfo::TRACKING);
static_assert(static_cast<int>(TrackingState::kDegraded) == stereo_descriptor_vo::VoInfo::DEGRADED);
static_assert(static_cast<int>(TrackingState::kLost) == stereo_descriptor_vo::VoInfo::LOST);

stereo_descriptor_vo::VoInfo toInfo(const OdometryResult& result,
                                    const stereo_descriptor_vo::StereoFeatures& features) {
  stereo_descriptor_vo::VoInfo info;
  info.state = toString(result.state);
  info.state_id = static_cast<std::uint8_t>(result.state);
  info.reason = result.reason;
  info.epoch = static_cast<std::uint32_t>(result.epoch);
  info.detected = features.detected;
  info.features = static_cast<std::uint32_t>(result.features);
  info.matches = static_cast<std::uint32_t>(result.matches);
  info.inliers = static_cast<std::uint32_t>(result.inliers);
  info.inlier_ratio =
      result.matches > 0 ? static_cast<float>(result.inliers) / static_cast<float>(result.matches) : 0.f;
  info.coverage = static_cast<float>(result.coverage);
  info.rms_reprojection_error = static_cast<float>(result.rms);
  info.detect_time = features.detect_time;
  info.stereo_time = features.stereo_time;
  info.describe_time = features.describe_time;
  info.match_time = static_cast<float>(result.match_time);
  info.motion_time = static_cast<float>(result.motion_time);
  info.dropped_pairs = features.dropped_pairs;
  info.correction_translation = static_cast<float>(result.correction.head<3>().norm());
  info.correction_rotation = static_cast<float>(result.correction.tail<3>().norm());
  info.distance = result.distance;
  info.probability = static_cast<float>(result.probability);
  info.keyframe_id = static_cast<std::uint32_t>(result.keyframe_id);
  info.disparity_offset = static_cast<float>(result.disparity_offset);
  info.disparity_offset_sigma = static_cast<float>(result.disparity_offset_sigma);
  info.disparity_bend = static_cast<float>(result.disparity_bend);
  info.disparity_bend_sigma = static_cast<float>(result.disparity_bend_sigma);
  info.right_delay = static_cast<float>(result.right_delay);
  info.right_delay_sigma = static_cast<float>(result.right_delay_sigma);
  info.readout = static_cast<float>(result.readout);
  info.readout_sigma = static_cast<float>(result.readout_sigma);
  info.used_readout = static_cast<float>(result.used_readout);
  for (int axis = 0; axis < 3; ++axis) {
    info.right_rotation[axis] = static_cast<float>(result.right_rotation[axis]);
    info.right_rotation_sigma[axis] = static_cast<float>(result.right_rotation_sigma[axis]);
  }
  return info;
}

stereo_descriptor_vo::FeatureFlow toFlow(const OdometryResult& result, const StereoFeatures& features) {
  stereo_descriptor_vo::FeatureFlow message;
  for (const FeatureFlow& flow : result.flow) {
    message.u_reference.push_back(flow.u_previous);
    message.v_reference.push_back(flow.v_previous);
    message.u.push_back(features.u[flow.current]);
    message.v.push_back(features.v[flow.current]);
    message.inlier.push_back(flow.inlier);
  }
  return message;
}

sensor_msgs::PointCloud2 toPointCloud(const std::vector<Eigen::Vector3d>& points,
                                      const Eigen::Isometry3d& T_cloud_points) {
  sensor_msgs::PointCloud2 cloud;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(points.size());
  if (points.empty()) return cloud;  // of which the iterator would take the first byte
  sensor_msgs::PointCloud2Iterator<float> out(cloud, "x");
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3f position = (T_cloud_points * point).cast<float>();
    for (int axis = 0; axis < 3; ++axis) out[axis] = position[axis];
    ++out;
  }
  return cloud;
}

}  // namespace sdvo::ros_conversions
