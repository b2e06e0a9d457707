#pragma once

#include <sensor_msgs/CameraInfo.h>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::ros_conversions {

/// Geometry from the two projection matrices with binning and region of interest applied (REP-104, image_geometry).
/// Throws std::invalid_argument when the cameras are uncalibrated, differ, or the baseline is not positive.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

}  // namespace sdvo::ros_conversions
