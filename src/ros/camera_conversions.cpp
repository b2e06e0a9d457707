#include "camera_conversions.hpp"

#include <image_geometry/pinhole_camera_model.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

namespace sdvo::ros_conversions {
namespace {

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

/// What to do about a baseline that is not positive.
std::string remedy(const image_geometry::PinholeCameraModel& left, const image_geometry::PinholeCameraModel& right) {
  if (left.Tx() == right.Tx())
    return "no baseline in P: P[3] of the right camera_info must be -fx * baseline (old camera drivers leave it out)";
  if (left.Tx() < 0.0 && right.Tx() == 0.0)
    return "are left and right swapped? Swap the topics; with depthai_ros_driver set "
           "stereo_i_reverse_stereo_socket_order to true";
  if (right.Tx() > 0.0) return "P[3] of the right camera_info has the wrong sign, it must be -fx * baseline";
  return "are left and right swapped?";
}

}  // namespace

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
                                describeP(left) + "; right " + describeP(right) +
                                "): " + remedy(left_model, right_model));
  camera.check();
  return camera;
}

}  // namespace sdvo::ros_conversions
