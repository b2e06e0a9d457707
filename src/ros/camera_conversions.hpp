#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <cmath>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"

namespace sdvo::ros_conversions {

/// Geometry from the two projection matrices with binning and region of interest applied (REP-104, image_geometry).
/// Throws std::invalid_argument when the cameras are uncalibrated, differ, or the baseline is not positive.
StereoCamera toStereoCamera(const sensor_msgs::CameraInfo& left, const sensor_msgs::CameraInfo& right);

}  // namespace sdvo::ros_conversions

namespace sdvo {

/// Whether two calibrations are one but for rounding: some drivers compute P anew for each image, or at each start.
inline bool isSameCamera(const StereoCamera& a, const StereoCamera& b) {
  constexpr double kPixels = 1e-3, kShare = 1e-5;
  const auto near = [](double x, double y, double tolerance) { return std::abs(x - y) <= tolerance; };
  return a.width == b.width && a.height == b.height && near(a.fx, b.fx, kPixels) && near(a.fy, b.fy, kPixels) &&
         near(a.cx, b.cx, kPixels) && near(a.cy, b.cy, kPixels) && near(a.baseline, b.baseline, kShare * a.baseline);
}

}  // namespace sdvo
