#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>

#include <array>
#include <functional>
#include <string>

#include "../ros/stereo_input.hpp"

namespace sdvo {

/// The stereo pairs of a recorded bag. Images stay on disk: only those at work and those without a partner so far are
/// in memory.
class BagPairs {
 public:
  /// When the four messages of a pair were recorded: left and right image, left and right calibration.
  using Times = std::array<ros::Time, 4>;
  using Use = std::function<void(const StereoPairMessages&, const Times& recorded, const ros::Time& arrival)>;

  /// Messages that made no pair.
  struct LeftOver {
    int stamps = 0;       ///< that are not on all four topics, or cannot be used
    std::string problem;  ///< why there may be no pair at all
  };

  /// `camera`: namespace of left|right/image_rect and camera_info. Throws std::runtime_error where a topic is missing.
  BagPairs(const std::string& path, const std::string& camera);

  /// Calls `use` for each four messages of one stamp, in the order in which they are complete: at `arrival`.
  LeftOver forEach(const Use& use) const;

  /// One pair again, found by the bag's index. Throws std::runtime_error where the bag has no such messages.
  StereoPairMessages read(const ros::Time& stamp, const Times& recorded) const;

 private:
  std::array<std::string, 4> topics_;
  rosbag::Bag bag_;
};

}  // namespace sdvo
