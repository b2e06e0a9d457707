#pragma once

#include <rosbag/bag.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace sdvo {

/// The odometry's own account of a drive that was recorded while it ran.
struct LiveRecord {
  std::array<int, 4> states{};      ///< pairs of each VoInfo::state_id
  std::vector<double> latencies;    ///< s, those known
  std::uint64_t dropped_pairs = 0;  ///< on either side
  int discontinuities = 0;          ///< of the pose

  int pairs() const;
};

/// Of the first topic with VoInfo in a bag; nothing without one.
std::optional<LiveRecord> readLiveRecord(const rosbag::Bag& bag);

}  // namespace sdvo
