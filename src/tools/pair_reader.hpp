#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <array>
#include <cstdint>
#include <optional>

#include "../ros/pair_decoder.hpp"
#include "recording.hpp"
#include "stereo_descriptor_vo/data/stereo_rectification.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// Of images that are rectified, side 0 (left) or 1. As in image_pipeline both views are expressed in the left optical
/// frame; the right one's place is in P's Tx = -fx * baseline.
sensor_msgs::CameraInfo toCameraInfo(const StereoCamera& camera, int side);
/// Of raw images: what rectifies them, and what the rectified ones are.
sensor_msgs::CameraInfo toCameraInfo(const StereoRectification& rectification, int side);

using StereoInfos = std::array<sensor_msgs::CameraInfo, 2>;

/// Of the files that stand for camera_info; none: it comes as messages.
std::optional<StereoInfos> infosOf(const StereoSource& source);

/// Turns the messages of one camera's pairs into rectified pairs. Images without "rect" in their topic's name are raw,
/// unless their camera_info has neither distortion nor rotation: they are rectified as by image_proc.
class PairReader {
 public:
  PairReader(const StereoTopics& topics, double fov);

  /// Throws std::invalid_argument where calibration or images cannot be used.
  RecordedPair read(const StereoPairMessages& pair, std::int64_t stamp);

 private:
  const StereoRectification& rectification(const StereoPairMessages& pair, const StereoCamera& camera);

  const bool may_be_raw_;
  const double fov_;
  PairDecoder decoder_;
  StereoInfos infos_;  ///< of the rectification, which follows them
  std::optional<StereoRectification> rectification_;
};

}  // namespace sdvo
