#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <string>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::ros_conversions {

/// Geometry of rectified images from P, binning and region of interest. The lens is no part of it: do_rectify says
/// whether the region was cut out before rectification or after, which is the same window of the rectified image.
/// Throws std::invalid_argument when the cameras are uncalibrated, differ, or the baseline is not positive.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

/// Why images are most likely not rectified although camera_info is that of a rectified pair; empty: nothing speaks for
/// it.
std::string whyUnrectified(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

}  // namespace sdvo::ros_conversions
