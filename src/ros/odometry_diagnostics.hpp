#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <mutex>
#include <optional>
#include <string>

#include "../config/interface_options.hpp"
#include "input_monitor.hpp"
#include "wall_updater.hpp"
#include "work_load.hpp"

namespace sdvo {

/// /diagnostics of the odometry: its state as vo_info tells it, the rate of its input, its load and how late it is.
class OdometryDiagnostics {
 public:
  OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                      const OdometryOutputOptions& options);

  InputMonitor& input() { return input_; }
  WorkLoad& load() { return load_; }
  /// Of each pair, as published.
  void note(const stereo_descriptor_vo::VoInfo& info);

 private:
  using Status = WallUpdater::Status;

  void diagnose(Status& status);
  void diagnoseLatency(Status& status);
  void summarise(Status& status) const;
  void addCalibration(Status& status) const;

  const double max_latency_;
  InputMonitor input_;
  WorkLoad load_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::VoInfo> last_;

  WallUpdater updater_;
};

}  // namespace sdvo
