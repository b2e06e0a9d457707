#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <string>

namespace sdvo {

/// /diagnostics of the place recognition, once a second.
class PlaceDiagnostics {
 public:
  /// `max_silence`: s, wall time. `input`: names of the topics that pairs come from.
  PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name, const std::string& input,
                   double max_silence);

  /// A pair with odometry has come.
  void notePair();
  /// Of each key frame, as published.
  void note(const stereo_descriptor_vo::PlaceInfo& info);
  /// Nothing is known any more, or what was loaded.
  void restart();
  /// While paused, silence is no fault.
  void notePaused(bool is_paused);

 private:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void diagnose(Status& status);
  void summarise(Status& status) const;

  const std::string input_;
  const double max_silence_;

  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::PlaceInfo> last_;
  std::optional<std::chrono::steady_clock::time_point> last_pair_;
  bool is_paused_ = false;

  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

}  // namespace sdvo
