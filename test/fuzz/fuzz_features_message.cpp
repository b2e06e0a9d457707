// A StereoFeatures message of any content: it is refused with one std::invalid_argument, or all that reads it can.

#include "../ros/message_samples.hpp"
#include "fuzz_message.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sdvo;
  FuzzBytes bytes(data, size);
  // One odometry for all: what comes after a message that was accepted must hold, too.
  static VisualOdometry odometry{VisualOdometryOptions{}};
  static std::int64_t stamp = 0;
  const auto type = bytes.oneOf(std::array{ElementType::kBits, ElementType::kUint8, ElementType::kFloat32});
  stereo_descriptor_vo::StereoFeatures input =
      ros_conversions::toMessage(ros_conversions::someFeatures(type), DepthScaleOptions{});
  damage(input, bytes);
  StereoFeatures features;
  try {
    features = ros_conversions::fromMessage(input);
  } catch (const std::invalid_argument&) {
    return 0;
  }
  features.check();
  features.stamp = stamp += 100000000;
  const OdometryResult result = odometry.update(features);
  ros_conversions::toPointCloud(StereoFeaturesView(input));
  ros_conversions::toFlow(result, features);
  ros_conversions::toInfo(result, input);
  if (result.has_pose && !result.T_origin_camera.matrix().allFinite()) __builtin_trap();
  return 0;
}
