#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <array>
#include <cstdint>
#include <optional>

#include "../data/stereo_rectification.hpp"
#include "../ros/synchronisation/pair_decoder.hpp"
#include "recording.hpp"
#include "stereo_messages.hpp"

namespace sdvo {

/// camera_info of rectified images, side 0 (left) or 1. As in image_pipeline both are in the left optical frame, and
/// the right camera's position is in P's Tx = -fx * baseline.
sensor_msgs::CameraInfo toCameraInfo(const StereoCamera& camera, int side);
/// camera_info of raw images: K, D and R rectify them, P is of the rectified ones.
sensor_msgs::CameraInfo toCameraInfo(const StereoRectification& rectification, int side);

using StereoInfos = std::array<sensor_msgs::CameraInfo, 2>;

/// From the files that stand for camera_info messages; none without such files. `images`: their size, which some formats
/// lack.
std::optional<StereoInfos> infosOf(const StereoSource& source, cv::Size images = {});

/// Turns the messages of one camera's pairs into rectified pairs. Images without "rect" in their topic's name are raw,
/// unless their camera_info has neither distortion nor rotation: they are rectified as by image_proc.
class PairReader {
 public:
  /// `find`: of TF, for a baseline that camera_info does not have.
  PairReader(const StereoTopics& topics, double fov, ros_conversions::FindTransform find = {});

  /// Throws std::invalid_argument where calibration or images cannot be used.
  RecordedPair read(const StereoPairMessages& pair, std::int64_t stamp);

 private:
  const StereoRectification& rectification(const StereoPairMessages& pair, const StereoCamera& camera);

  const bool may_be_raw_;
  const double fov_;
  PairDecoder decoder_;
  StereoInfos infos_;  ///< from which the rectification was made
  std::optional<StereoRectification> rectification_;
};

}  // namespace sdvo
