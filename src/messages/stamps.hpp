#pragma once

#include <ros/time.h>

#include <cstdint>
#include <string>

namespace sdvo {

/// Since 1970. For arithmetic: ros::Duration throws where two stamps are more than 68 years apart.
inline std::int64_t nanoseconds(const ros::Time& time) {
  return static_cast<std::int64_t>(time.toNSec());
}

/// s, negative when `to` is earlier.
inline double secondsBetween(const ros::Time& from, const ros::Time& to) {
  return 1e-9 * static_cast<double>(nanoseconds(to) - nanoseconds(from));
}

/// Why nothing can be done with a stamp; empty when it can be used. Stamps from 2^31 s (the year 2038) on are refused:
/// ROS's synchronisers and every TF listener, those of other nodes included, throw at differences beyond that.
inline std::string whyUnusable(const ros::Time& stamp) {
  if (stamp.isZero()) return "zero stamp: the message has no time";
  if (stamp.sec >= (1u << 31)) return "stamp of " + std::to_string(stamp.sec) + " s lies beyond what ROS can compare";
  return "";
}

}  // namespace sdvo
