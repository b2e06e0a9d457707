#pragma once

#include <ros/time.h>

#include <cstdint>
#include <string>

namespace sdvo {

/// ns since 1970. Use it for differences: ros::Duration throws for stamps that are more than 68 years apart.
inline std::int64_t nanoseconds(const ros::Time& time) {
  return static_cast<std::int64_t>(time.toNSec());
}

/// s, negative when `to` is earlier.
inline double secondsBetween(const ros::Time& from, const ros::Time& to) {
  return 1e-9 * static_cast<double>(nanoseconds(to) - nanoseconds(from));
}

/// Why a stamp cannot be used; empty if it can. Stamps from 2^31 s (the year 2038) on are refused: ROS' synchronisers
/// and all TF listeners, also in other nodes, throw at differences beyond that.
inline std::string whyUnusable(const ros::Time& stamp) {
  if (stamp.isZero()) return "zero stamp: the message has no time";
  if (stamp.sec >= (1u << 31)) return "stamp of " + std::to_string(stamp.sec) + " s lies beyond what ROS can compare";
  return "";
}

}  // namespace sdvo
