#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <diagnostic_updater/update_functions.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

namespace sdvo {

/// /diagnostics of the odometry, once a second: its state as vo_info tells it, how long ago that was, and the rate of
/// its input.
class OdometryDiagnostics {
 public:
  /// `max_silence`: s, wall time. `input`: name of the topic that pairs come from.
  OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                      const std::string& input, double max_silence);

  /// Of each pair, as published.
  void note(const stereo_descriptor_vo::VoInfo& info);
  /// While paused, silence is no fault.
  void notePaused(bool is_paused);

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void diagnose(Status& status);
  void summarise(Status& status) const;
  void addCalibration(Status& status) const;

  const std::string input_;
  const double max_silence_;
  double min_rate_, max_rate_;  // the frequency's task refers to them

  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::VoInfo> last_;
  std::chrono::steady_clock::time_point last_time_;
  bool is_paused_ = false;

  diagnostic_updater::FrequencyStatus rate_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

}  // namespace sdvo
