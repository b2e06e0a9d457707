#pragma once

#include <optional>
#include <stdexcept>
#include <utility>

#include "../../config/interface_options.hpp"
#include "../../messages/frames.hpp"

namespace sdvo {

/// The options with frame ids as tf2 wants them. Throws std::invalid_argument if frames have no names or contradict
/// each other.
inline OdometryOutputOptions withCleanFrames(OdometryOutputOptions options) {
  using ros_conversions::requireTwoFrames;
  const std::string &odom = options.odom_frame_id, &base = options.base_frame_id, &guess = options.guess_frame_id;
  requireTwoFrames({"odom_frame_id", odom}, {"base_frame_id", base});
  if (!options.ground_truth_frame_id.empty() && options.ground_truth_base_frame_id.empty() && options.publish_tf)
    throw std::invalid_argument(
        "on TF base_frame_id is below odom_frame_id, not below ground_truth_frame_id: set ground_truth_base_frame_id "
        "to the frame that has the base's true pose, or publish_tf to false");
  if (options.ground_truth_base_frame_id.empty()) options.ground_truth_base_frame_id = base;
  if (!guess.empty()) requireTwoFrames({"guess_frame_id", guess}, {"base_frame_id", base});
  if (!guess.empty() && options.publish_tf) requireTwoFrames({"guess_frame_id", guess}, {"odom_frame_id", odom});
  for (std::string* frame : {&options.odom_frame_id, &options.base_frame_id, &options.guess_frame_id,
                             &options.ground_truth_frame_id, &options.ground_truth_base_frame_id})
    *frame = ros_conversions::cleanFrameId(*frame);
  return options;
}

/// Parent and child of the transform that is published on TF, if any.
inline std::optional<ros_conversions::OdometryFrames> publishedFrames(const OdometryOutputOptions& options) {
  if (!options.publish_tf) return std::nullopt;
  ros_conversions::OdometryFrames frames{options.odom_frame_id,
                                         options.correctsGuess() ? options.guess_frame_id : options.base_frame_id};
  if (options.invert_tf) std::swap(frames.odom, frames.base);
  return frames;
}

}  // namespace sdvo
