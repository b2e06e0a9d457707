// Two camera_info of any content: a camera that checks, or one std::invalid_argument.
#include <stdexcept>

#include "../../src/messages/camera_conversions.hpp"
#include "fuzz_bytes.hpp"

namespace {

sensor_msgs::CameraInfo cameraInfo(sdvo::FuzzBytes& bytes) {
  sensor_msgs::CameraInfo info;
  info.width = bytes.any<std::uint32_t>();
  info.height = bytes.any<std::uint32_t>();
  info.distortion_model = bytes.flag() ? "plumb_bob" : bytes.text(20);
  info.binning_x = bytes.any<std::uint32_t>();
  info.binning_y = bytes.any<std::uint32_t>();
  info.roi.x_offset = bytes.any<std::uint32_t>();
  info.roi.y_offset = bytes.any<std::uint32_t>();
  info.roi.width = bytes.any<std::uint32_t>();
  info.roi.height = bytes.any<std::uint32_t>();
  info.roi.do_rectify = bytes.flag();
  for (double& element : info.K) element = bytes.any<double>();
  for (double& element : info.R) element = bytes.any<double>();
  for (double& element : info.P) element = bytes.any<double>();
  info.D.resize(bytes.upTo(20));
  for (double& element : info.D) element = bytes.any<double>();
  return info;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sdvo::FuzzBytes bytes(data, size);
  sensor_msgs::CameraInfo left = cameraInfo(bytes);
  // Most pairs that are nearly good differ in little.
  sensor_msgs::CameraInfo right = bytes.flag() ? left : cameraInfo(bytes);
  right.P[3] = bytes.any<double>();
  try {
    sdvo::ros_conversions::toStereoCamera(left, right).check();
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
