#pragma once

#include <ros/time.h>
#include <rosbag/bag.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "camera_input.hpp"
#include "recording.hpp"

namespace sdvo {

/// The stereo pairs of a recorded bag. In memory are only those at work and those without a partner so far.
class BagRecording : public Recording {
 public:
  /// Throws std::runtime_error where a topic is missing.
  BagRecording(const std::string& path, const StereoSource& source);

  int size() const override;
  int forEach(int limit, const Use& use, const Refuse& refuse) override;
  void forEachBackwards(const Use& use) const override;
  ArrivalFindings arrivals(const std::string& base_frame) const override { return input_->findings(base_frame, true); }

 private:
  /// Of the four messages of a pair.
  struct Used {
    std::array<ros::Time, 4> stamps, recorded;
  };

  int useAll(int limit, const Use& use, const Refuse& refuse);
  StereoPairMessages read(const Used& pair) const;

  const std::string path_;
  const double fov_;
  const std::optional<StereoInfos> infos_;  ///< in place of those of the bag
  rosbag::Bag bag_;
  StereoTopics topics_;
  std::vector<Used> used_;
  std::unique_ptr<CameraInput> input_;  ///< of the last forEach()
};

}  // namespace sdvo
