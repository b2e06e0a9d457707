// A StereoFeatures message of any content: it is refused with one std::invalid_argument, or all that reads it can.
#include <fuzzer/FuzzedDataProvider.h>

#include <stdexcept>

#include "../ros/message_samples.hpp"

namespace {

using namespace sdvo;

/// Sometimes of another length, with some other elements.
template <class Vector>
void damage(Vector& values, FuzzedDataProvider& bytes) {
  if (bytes.ConsumeBool()) values.resize(bytes.ConsumeIntegralInRange<std::size_t>(0, 64));
  while (!values.empty() && bytes.ConsumeBool()) {
    auto& element = values[bytes.ConsumeIntegralInRange<std::size_t>(0, values.size() - 1)];
    bytes.ConsumeData(&element, sizeof(element));
  }
}

stereo_descriptor_vo::StereoFeatures message(FuzzedDataProvider& bytes) {
  const auto type = bytes.PickValueInArray({ElementType::kBits, ElementType::kUint8, ElementType::kFloat32});
  stereo_descriptor_vo::StereoFeatures message =
      ros_conversions::toMessage(ros_conversions::someFeatures(type), DepthScaleOptions{});
  const auto replace = [&bytes](auto& value) {
    if (bytes.ConsumeBool()) bytes.ConsumeData(&value, sizeof(value));
  };
  replace(message.image_width), replace(message.image_height);
  replace(message.fx), replace(message.fy), replace(message.cx), replace(message.cy), replace(message.baseline);
  replace(message.bytes_per_row), replace(message.stream_epoch);
  replace(message.patch_side), replace(message.patch_min_spacing), replace(message.patch_spacing);
  if (bytes.ConsumeBool()) message.descriptor = bytes.ConsumeRandomLengthString(12);
  if (bytes.ConsumeBool()) message.layout = bytes.ConsumeRandomLengthString(12);
  if (bytes.ConsumeBool()) message.element_type = bytes.ConsumeRandomLengthString(12);
  for (auto* values :
       {&message.u, &message.v, &message.disparity, &message.dv, &message.size, &message.angle, &message.response})
    damage(*values, bytes);
  damage(message.descriptors, bytes);
  damage(message.patches, bytes);
  return message;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider bytes(data, size);
  // One odometry for all: what comes after a message that was accepted must hold, too.
  static VisualOdometry odometry{VisualOdometryOptions{}};
  static std::int64_t stamp = 0;
  const stereo_descriptor_vo::StereoFeatures input = message(bytes);
  StereoFeatures features;
  try {
    features = ros_conversions::fromMessage(input);
  } catch (const std::invalid_argument&) {
    return 0;
  }
  features.check();
  features.stamp = stamp += 100000000;
  const OdometryResult result = odometry.update(features);
  ros_conversions::toPointCloud(input);
  ros_conversions::toFlow(result, features);
  ros_conversions::toInfo(result, input);
  if (result.has_pose && !result.T_origin_camera.matrix().allFinite()) __builtin_trap();
  return 0;
}
