#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>

#include <mutex>
#include <optional>
#include <string>

#include "input_monitor.hpp"
#include "wall_updater.hpp"

namespace sdvo {

/// /diagnostics of the place recognition.
class PlaceDiagnostics {
 public:
  /// `max_silence`: s, wall time. `input`: names of the topics that pairs come from.
  PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name, const std::string& input,
                   double max_silence);

  /// Of pairs with odometry.
  InputMonitor& input() { return input_; }
  /// Of each key frame, as published.
  void note(const stereo_descriptor_vo::PlaceInfo& info);
  /// Nothing is known any more, or what was loaded.
  void restart();

 private:
  using Status = WallUpdater::Status;

  void diagnose(Status& status);
  void summarise(Status& status) const;

  InputMonitor input_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::PlaceInfo> last_;

  WallUpdater updater_;
};

}  // namespace sdvo
