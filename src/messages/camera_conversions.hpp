#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <string>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::ros_conversions {

/// Geometry of rectified images from P, binning and region of interest. do_rectify does not matter: a region that is
/// cut out before or after rectification is the same window of the rectified image. Throws std::invalid_argument if the
/// cameras are uncalibrated or differ, or the baseline is not positive.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

/// Evidence that the images are not rectified, although camera_info is that of a rectified pair; empty: none.
std::string whyUnrectified(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

}  // namespace sdvo::ros_conversions
