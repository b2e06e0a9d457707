#pragma once

#include <string>

namespace sdvo::ros_conversions {

/// Frame id as tf2 wants it, without a leading slash.
inline std::string cleanFrameId(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

}  // namespace sdvo::ros_conversions
