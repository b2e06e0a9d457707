#include "conversions.hpp"

#include <image_geometry/pinhole_camera_model.h>
#include <sensor_msgs/image_encodings.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <locale>
#include <map>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

#include "stereo_descriptor_vo/ros/stereo_features_view.hpp"

namespace sdvo::ros_conversions {
namespace {

namespace encodings = sensor_msgs::image_encodings;

/// The bytes of a matrix, row by row.
std::vector<std::uint8_t> bytesOf(const cv::Mat& matrix) {
  CV_Assert(matrix.empty() || matrix.isContinuous());
  const std::uint8_t* first = matrix.data;  // not datastart: it may be part of a larger one
  return {first, first + matrix.total() * matrix.elemSize()};
}

/// Variance of what is not known at all, and the floor that keeps every covariance positive.
constexpr double kUnknownVariance = 1e6;
constexpr double kVarianceFloor = 1e-9;

image_geometry::PinholeCameraModel toCameraModel(const sensor_msgs::CameraInfo& info, const char* side) {
  const std::string name = std::string(side) + " camera_info";
  if (info.width == 0 || info.height == 0) throw std::invalid_argument(name + " has no image size");
  for (std::size_t i = 0; i < info.P.size(); ++i)
    if (!std::isfinite(info.P[i])) throw std::invalid_argument(name + ": P[" + std::to_string(i) + "] is not a number");
  if (info.K[0] == 0.0 || info.P[0] == 0.0)
    throw std::invalid_argument(name + ": K or P is zero, the camera is not calibrated (REP-104)");
  image_geometry::PinholeCameraModel model;
  try {
    model.fromCameraInfo(info);
    model.reducedResolution();  // rectifies the region of interest, which fails for some distortions
  } catch (const std::exception& e) {
    throw std::invalid_argument(name + ": " + e.what());
  }
  return model;
}

std::string describeP(const sensor_msgs::CameraInfo& info) {
  std::ostringstream text;
  text << "fx = " << info.P[0] << ", fy = " << info.P[5] << ", cx = " << info.P[2] << ", cy = " << info.P[6]
       << ", Tx = " << info.P[3];
  return text.str();
}

std::string describe(const cv::Size& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

/// Over a gap the mean velocity, which is all that is measured, says little of that at its end: meanwhile a vehicle may
/// accelerate by 5 m/s^2 and 2 rad/s^2.
Matrix6d unsteadiness(double dt) {
  constexpr double kSteady = 0.2;  // s
  const double gap = std::max(0.0, dt - kSteady);
  Vector6d deviation;
  deviation << Eigen::Vector3d::Constant(0.5 * 5.0 * gap), Eigen::Vector3d::Constant(0.5 * 2.0 * gap);
  return deviation.cwiseAbs2().asDiagonal();
}

template <class Covariance>
void fillCovariance(const Matrix6d& covariance, Covariance& message) {
  Matrix6d symmetric = 0.5 * (covariance + covariance.transpose());
  symmetric.diagonal().array() += kVarianceFloor;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) message[6 * row + column] = symmetric(row, column);
}

/// The pixels of an image, of some bytes each; refers to the message. Not by cv_bridge, which brings OpenCV's readers
/// of image files and with them 40 MB of libraries.
cv::Mat pixelsOf(const sensor_msgs::Image& message, int bytes) {
  const std::size_t rows = message.height, columns = message.width, step = message.step;
  if (rows == 0 || columns == 0 || step < static_cast<std::size_t>(bytes) * columns ||
      message.data.size() < step * rows)
    throw std::invalid_argument("malformed image: " + std::to_string(message.data.size()) + " bytes in rows of " +
                                std::to_string(step) + " for " + std::to_string(columns) + "x" + std::to_string(rows) +
                                " pixels of " + std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes"));
  return cv::Mat(static_cast<int>(rows), static_cast<int>(columns), CV_8UC(bytes),
                 const_cast<std::uint8_t*>(message.data.data()), step);
}

/// The pixels of a mono16 image in this machine's order of bytes; refers to the message where that is its order.
cv::Mat pixelsOf16Bits(const sensor_msgs::Image& message) {
  const cv::Mat bytes = pixelsOf(message, 2);
  const std::uint16_t probe = 1;
  const bool machine_is_bigendian = *reinterpret_cast<const std::uint8_t*>(&probe) == 0;
  if ((message.is_bigendian != 0) == machine_is_bigendian)
    return cv::Mat(bytes.rows, bytes.cols, CV_16U, bytes.data, bytes.step);
  cv::Mat swapped(bytes.size(), CV_8UC2);
  const int from_to[] = {0, 1, 1, 0};
  cv::mixChannels(&bytes, 1, &swapped, 1, from_to, 2);
  return cv::Mat(swapped.rows, swapped.cols, CV_16U, swapped.data, swapped.step).clone();
}

}  // namespace

std::string cleanFrameId(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right) {
  const image_geometry::PinholeCameraModel left_model = toCameraModel(left, "left");
  const image_geometry::PinholeCameraModel right_model = toCameraModel(right, "right");
  const cv::Size size = left_model.reducedResolution(), right_size = right_model.reducedResolution();
  if (size != right_size)
    throw std::invalid_argument("left and right camera_info have different image sizes (left " + describe(size) +
                                ", right " + describe(right_size) + ")");
  constexpr double kSame = 1e-3;  // px
  const auto differ = [](double a, double b) { return !(std::abs(a - b) <= kSame); };
  if (differ(left_model.fx(), right_model.fx()) || differ(left_model.fy(), right_model.fy()))
    throw std::invalid_argument("left and right camera_info have different focal lengths (left " + describeP(left) +
                                "; right " + describeP(right) + "), the pair is not rectified");
  // A rectification without CALIB_ZERO_DISPARITY; every depth would be wrong.
  if (differ(left_model.cx(), right_model.cx()) || differ(left_model.cy(), right_model.cy()))
    throw std::invalid_argument("left and right camera_info have different principal points (left " + describeP(left) +
                                "; right " + describeP(right) + "), rectify with zero disparity at infinity");
  StereoCamera camera;
  camera.fx = left_model.fx();
  camera.fy = left_model.fy();
  camera.cx = left_model.cx();
  camera.cy = left_model.cy();
  // The left P may have a Tx of its own (KITTI's colour pair), so that the baseline is a difference.
  camera.baseline = left_model.Tx() / left_model.fx() - right_model.Tx() / right_model.fx();
  camera.width = size.width;
  camera.height = size.height;
  if (!(camera.baseline > 0.0))
    throw std::invalid_argument("baseline = " + std::to_string(camera.baseline) + " m is not positive (left " +
                                describeP(left) + "; right " + describeP(right) + "): are left and right swapped?");
  camera.check();
  return camera;
}

int bitDepth(const sensor_msgs::Image& message) {
  if (message.encoding != encodings::MONO16) return 8;
  double brightest = 0.0;
  cv::minMaxLoc(pixelsOf16Bits(message), nullptr, &brightest);
  for (int bits = 8; bits < 16; bits += 2)
    if (brightest < (1 << bits)) return bits;
  return 16;
}

cv::Mat toGrey(const sensor_msgs::ImageConstPtr& message, int bits) {
  if (message->encoding == encodings::MONO8 || message->encoding == encodings::TYPE_8UC1) return pixelsOf(*message, 1);
  cv::Mat grey;
  if (message->encoding == encodings::MONO16) {
    pixelsOf16Bits(*message).convertTo(grey, CV_8U, 255.0 / ((1 << bits) - 1));
    return grey;
  }
  static const std::map<std::string, cv::ColorConversionCodes> colours = {{encodings::BGR8, cv::COLOR_BGR2GRAY},
                                                                          {encodings::RGB8, cv::COLOR_RGB2GRAY},
                                                                          {encodings::BGRA8, cv::COLOR_BGRA2GRAY},
                                                                          {encodings::RGBA8, cv::COLOR_RGBA2GRAY}};
  const auto colour = colours.find(message->encoding);
  if (colour == colours.end())
    throw std::invalid_argument("encoding '" + message->encoding +
                                "' is not supported: mono8, 8UC1, mono16, bgr8, rgb8, bgra8 and rgba8 are");
  cv::cvtColor(pixelsOf(*message, encodings::numChannels(message->encoding)), grey, colour->second);
  return grey;
}

stereo_descriptor_vo::StereoFeatures toMessage(const StereoFeatures& features, const DepthScaleOptions& size_curve) {
  stereo_descriptor_vo::StereoFeatures message;
  message.image_width = static_cast<std::uint32_t>(features.camera.width);
  message.image_height = static_cast<std::uint32_t>(features.camera.height);
  message.fx = features.camera.fx;
  message.fy = features.camera.fy;
  message.cx = features.camera.cx;
  message.cy = features.camera.cy;
  message.baseline = features.camera.baseline;
  message.descriptor = features.descriptor;
  message.layout = nameOf(features.layout);
  message.element_type = nameOf(features.element_type);
  message.bytes_per_row = static_cast<std::uint32_t>(features.descriptors.cols);
  message.scale_normalised = size_curve.scale_normalisation;
  message.size_slope = static_cast<float>(size_curve.slope);
  message.size_exponent = static_cast<float>(size_curve.exponent);
  message.size_offset = static_cast<float>(size_curve.offset);
  message.size_min =
      static_cast<float>(size_curve.scale_normalisation ? size_curve.min_size : size_curve.constant_size);
  message.size_max =
      static_cast<float>(size_curve.scale_normalisation ? size_curve.max_size : size_curve.constant_size);

  const ExtractionReport& report = features.report;
  message.detected = static_cast<std::uint32_t>(report.detected);
  for (int side = 0; side < 2; ++side) {
    message.mean_intensity[side] = static_cast<float>(report.mean_intensity[side]);
    message.sharpness[side] = static_cast<float>(report.sharpness[side]);
  }
  message.detect_time = static_cast<float>(report.detect_time);
  message.stereo_time = static_cast<float>(report.stereo_time);
  message.describe_time = static_cast<float>(report.describe_time);
  message.refused = report.refused;
  message.status = report.status;

  message.u = features.u;
  message.v = features.v;
  message.disparity = features.disparity;
  message.dv = features.dv;
  message.size = features.size;
  message.angle = features.angle;
  message.response = features.response;
  message.descriptors = bytesOf(features.descriptors);
  message.patch_side = static_cast<std::uint32_t>(features.patch_layout.side);
  message.patch_min_spacing = features.patch_layout.min_spacing;
  message.patch_spacing = features.patch_layout.spacing_by_size;
  message.patches = bytesOf(features.patches);
  return message;
}

StereoFeatures fromMessage(const stereo_descriptor_vo::StereoFeatures& message) {
  const StereoFeaturesView view(message);  // throws unless everything holds together
  StereoFeatures features;
  features.stamp = static_cast<std::int64_t>(message.header.stamp.toNSec());
  features.camera = {message.fx,
                     message.fy,
                     message.cx,
                     message.cy,
                     message.baseline,
                     static_cast<int>(message.image_width),
                     static_cast<int>(message.image_height)};
  features.descriptor = message.descriptor;
  features.layout = valueOf<DescriptorLayout>(message.layout);
  features.element_type = valueOf<ElementType>(message.element_type);
  features.u = message.u;
  features.v = message.v;
  features.disparity = message.disparity;
  features.dv = message.dv;
  features.size = message.size;
  features.angle = message.angle;
  features.response = message.response;
  features.descriptors = cv::Mat(features.count(), static_cast<int>(message.bytes_per_row), CV_8U,
                                 const_cast<std::uint8_t*>(message.descriptors.data()))
                             .clone();
  features.patch_layout = {static_cast<int>(message.patch_side), message.patch_min_spacing, message.patch_spacing};
  features.patches = view.patches().clone();

  ExtractionReport& report = features.report;
  report.detected = static_cast<int>(message.detected);
  for (int side = 0; side < 2; ++side) {
    report.mean_intensity[side] = message.mean_intensity[side];
    report.sharpness[side] = message.sharpness[side];
  }
  report.detect_time = message.detect_time;
  report.stereo_time = message.stereo_time;
  report.describe_time = message.describe_time;
  report.refused = message.refused;
  report.status = message.status;
  return features;
}

nav_msgs::Odometry toOdometry(const OdometryResult& result, const Eigen::Isometry3d& T_base_camera,
                              const OdometryFrames& frames, const Eigen::Isometry3d& T_odom_start) {
  nav_msgs::Odometry odometry;
  odometry.header.stamp.fromNSec(static_cast<std::uint64_t>(result.stamp));
  odometry.header.frame_id = frames.odom;
  odometry.child_frame_id = frames.base;

  // The base starts where the core's origin, the camera's first pose, puts it.
  const Eigen::Isometry3d T_odom_base =
      orthonormalised(T_odom_start * T_base_camera * result.T_origin_camera * T_base_camera.inverse());
  odometry.pose.pose = tf2::toMsg(T_odom_base);

  // Perturbations of the camera, in its own axes, become those of the base; then the axes of odom.
  const Matrix6d to_base = adjoint(T_base_camera);
  Matrix6d to_odom_axes = Matrix6d::Zero();
  to_odom_axes.topLeftCorner<3, 3>() = T_odom_base.linear();
  to_odom_axes.bottomRightCorner<3, 3>() = T_odom_base.linear();
  const Matrix6d to_pose = to_odom_axes * to_base;
  fillCovariance(to_pose * result.pose_covariance * to_pose.transpose(), odometry.pose.covariance);

  if (!result.has_motion || !(result.dt > 0.0)) {
    fillCovariance(kUnknownVariance * Matrix6d::Identity(), odometry.twist.covariance);
    return odometry;
  }
  const Vector6d twist = logSE3(T_base_camera * result.T_previous_current * T_base_camera.inverse()) / result.dt;
  odometry.twist.twist.linear.x = twist[0];
  odometry.twist.twist.linear.y = twist[1];
  odometry.twist.twist.linear.z = twist[2];
  odometry.twist.twist.angular.x = twist[3];
  odometry.twist.twist.angular.y = twist[4];
  odometry.twist.twist.angular.z = twist[5];
  fillCovariance(
      to_base * result.motion_covariance * to_base.transpose() / (result.dt * result.dt) + unsteadiness(result.dt),
      odometry.twist.covariance);
  return odometry;
}

Eigen::Isometry3d toPose(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double x, y, z, roll, pitch, yaw;
  if (!(stream >> x >> y >> z >> roll >> pitch >> yaw) || !(stream >> std::ws).eof())
    throw std::invalid_argument("'" + text + "' is no pose: six numbers 'x y z roll pitch yaw' (m, rad) are");
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

Eigen::Isometry3d toPose(const geometry_msgs::Pose& message) {
  constexpr double kUnitLength = 1e-3;
  const auto& p = message.position;
  const auto& q = message.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
    throw std::invalid_argument("the position is not finite");
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitLength))
    throw std::invalid_argument("the quaternion has not unit length");
  return Eigen::Translation3d(p.x, p.y, p.z) * rotation.normalized();
}

Matrix6d toMotionCovariance(const nav_msgs::Odometry& odometry, double dt, const Eigen::Isometry3d& T_base_camera) {
  Matrix6d twist;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) twist(row, column) = odometry.twist.covariance[6 * row + column];
  if (!twist.allFinite()) throw std::invalid_argument("the twist's covariance is not finite");
  const Matrix6d steady = twist - unsteadiness(dt);
  // Of a fused odometry it never was a part.
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

stereo_descriptor_vo::VoInfo toInfo(const OdometryResult& result,
                                    const stereo_descriptor_vo::StereoFeatures& features) {
  stereo_descriptor_vo::VoInfo info;
  info.state = toString(result.state);
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
  info.keyframe_id = static_cast<std::uint32_t>(result.keyframe_id);
  info.disparity_offset = static_cast<float>(result.disparity_offset);
  info.disparity_offset_sigma = static_cast<float>(result.disparity_offset_sigma);
  info.disparity_bend = static_cast<float>(result.disparity_bend);
  info.disparity_bend_sigma = static_cast<float>(result.disparity_bend_sigma);
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

sensor_msgs::PointCloud2 toPointCloud(const stereo_descriptor_vo::StereoFeatures& features) {
  const StereoFeaturesView view(features);
  sensor_msgs::PointCloud2 cloud;
  cloud.header = features.header;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2Fields(4, "x", 1, sensor_msgs::PointField::FLOAT32, "y", 1, sensor_msgs::PointField::FLOAT32,
                                "z", 1, sensor_msgs::PointField::FLOAT32, "disparity", 1,
                                sensor_msgs::PointField::FLOAT32);
  modifier.resize(static_cast<std::size_t>(view.count()));
  if (view.count() == 0) return cloud;  // of which the iterator would take the first byte
  sensor_msgs::PointCloud2Iterator<float> out(cloud, "x");
  for (int i = 0; i < view.count(); ++i, ++out) {
    const cv::Point3d point = view.point(i);
    out[0] = static_cast<float>(point.x);
    out[1] = static_cast<float>(point.y);
    out[2] = static_cast<float>(point.z);
    out[3] = features.disparity[i];
  }
  return cloud;
}

}  // namespace sdvo::ros_conversions
