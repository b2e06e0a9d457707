#pragma once

#include <ros/time.h>

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace sdvo::ros_conversions {

/// Stamp in ns.
inline ros::Time toTime(std::int64_t stamp) {
  return ros::Time().fromNSec(static_cast<std::uint64_t>(stamp));
}

/// Throws std::invalid_argument that gives `name` when the number is too large.
inline int toInt(std::uint32_t number, const char* name) {
  if (number >= static_cast<std::uint32_t>(std::numeric_limits<int>::max()))
    throw std::invalid_argument(std::string(name) + " " + std::to_string(number) + " is too large");
  return static_cast<int>(number);
}

}  // namespace sdvo::ros_conversions
