// Two camera_info of any content: a camera that checks, or one std::invalid_argument.
#include <fuzzer/FuzzedDataProvider.h>

#include <stdexcept>

#include "../../src/messages/camera_conversions.hpp"

namespace {

sensor_msgs::CameraInfo cameraInfo(FuzzedDataProvider& bytes) {
  sensor_msgs::CameraInfo info;
  info.width = bytes.ConsumeIntegral<std::uint32_t>();
  info.height = bytes.ConsumeIntegral<std::uint32_t>();
  info.distortion_model = bytes.ConsumeBool() ? "plumb_bob" : bytes.ConsumeRandomLengthString(20);
  info.binning_x = bytes.ConsumeIntegral<std::uint32_t>();
  info.binning_y = bytes.ConsumeIntegral<std::uint32_t>();
  info.roi.x_offset = bytes.ConsumeIntegral<std::uint32_t>();
  info.roi.y_offset = bytes.ConsumeIntegral<std::uint32_t>();
  info.roi.width = bytes.ConsumeIntegral<std::uint32_t>();
  info.roi.height = bytes.ConsumeIntegral<std::uint32_t>();
  info.roi.do_rectify = bytes.ConsumeBool();
  const auto any = [&bytes] {
    double value = 0.0;
    bytes.ConsumeData(&value, sizeof(value));  // not-a-number and infinity too
    return value;
  };
  for (double& element : info.K) element = any();
  for (double& element : info.R) element = any();
  for (double& element : info.P) element = any();
  info.D.resize(bytes.ConsumeIntegralInRange<std::size_t>(0, 20));
  for (double& element : info.D) element = any();
  return info;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  sensor_msgs::CameraInfo left = cameraInfo(bytes);
  // Most pairs that are nearly good differ in little.
  sensor_msgs::CameraInfo right = bytes.ConsumeBool() ? left : cameraInfo(bytes);
  bytes.ConsumeData(&right.P[3], sizeof(double));
  try {
    sdvo::ros_conversions::toStereoCamera(left, right).check();
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
