#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::ros_conversions {

/// T_parent_child on TF; none, with the problem.
using FindTransform =
    std::function<std::optional<Eigen::Isometry3d>(const std::string& parent, const std::string& child, std::string&)>;

/// Geometry of rectified images from P, binning and region of interest. do_rectify does not matter: a region that is
/// cut out before or after rectification is the same window of the rectified image. Throws std::invalid_argument if the
/// cameras are uncalibrated or differ, or the baseline is not positive. Where neither P has one (simulators), it is that
/// of both optical frames on TF, by `find`.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right,
                            const FindTransform& find = {});

/// Evidence that the images are not rectified, although camera_info is that of a rectified pair; empty: none.
std::string whyUnrectified(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

}  // namespace sdvo::ros_conversions
