#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>

#include <array>
#include <string>
#include <vector>

#include "../ros/stereo_input.hpp"
#include "recording.hpp"

namespace sdvo {

/// The stereo pairs of a recorded bag. In memory are only those at work and those without a partner so far.
class BagRecording : public Recording {
 public:
  /// Throws std::runtime_error where a topic is missing.
  BagRecording(const std::string& path, const StereoNames& names);

  int size() const override;
  int forEach(int limit, const Use& use) override;
  void forEachBackwards(const Use& use) const override;
  ArrivalFindings arrivals(const std::string& base_frame) const override;

 private:
  /// Times at which the four messages of a pair were recorded.
  using Times = std::array<ros::Time, 4>;
  struct Part {
    StereoPairMessages messages;
    Times recorded;
  };
  struct Used {
    ros::Time stamp;
    Times recorded;
  };
  StereoPairMessages read(const Used& pair) const;

  int useAll(int limit, const Use& use);

  const std::string path_;
  rosbag::Bag bag_;
  StereoTopics topics_;
  std::vector<Used> used_;
};

}  // namespace sdvo
