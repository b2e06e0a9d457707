#pragma once

#include <stdexcept>
#include <string>

namespace sdvo::ros_conversions {

/// Frame id as tf2 wants it, without a leading slash.
inline std::string cleanFrameId(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

/// Names of the two frames an odometry connects.
struct OdometryFrames {
  std::string odom = "odom";
  std::string base = "base_link";
};

/// A frame and the parameter that names it.
struct NamedFrame {
  std::string parameter, frame;
};

/// Throws std::invalid_argument if a frame has no name, which TF requires.
inline void requireName(const NamedFrame& named) {
  if (cleanFrameId(named.frame).empty())
    throw std::invalid_argument(named.parameter + " is empty: give the frame a name");
}

/// Throws std::invalid_argument if a frame has no name or both have the same one.
inline void requireTwoFrames(const NamedFrame& parent, const NamedFrame& child) {
  requireName(parent);
  requireName(child);
  if (cleanFrameId(parent.frame) == cleanFrameId(child.frame))
    throw std::invalid_argument(parent.parameter + " and " + child.parameter + " are both '" + child.frame +
                                "': give them different names");
}

}  // namespace sdvo::ros_conversions
