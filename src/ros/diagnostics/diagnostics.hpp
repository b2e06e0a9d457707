#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <mutex>
#include <optional>
#include <string>

#include "../../check/arrival_log.hpp"
#include "../../check/image_check.hpp"
#include "../../check/input_monitor.hpp"
#include "../../check/unused_input.hpp"
#include "../../check/work_load.hpp"
#include "../../config/interface_options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// /diagnostics once a second of wall time: simulated time stands still at the end of a bag, which diagnostics must
/// report. Declare it after the members that its tasks use.
class WallUpdater {
 public:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  using Level = diagnostic_msgs::DiagnosticStatus;

  WallUpdater(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name)
      : updater_(nh, private_nh, name) {
    updater_.setHardwareID("none");
    timer_ =
        nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.force_update(); });
  }

  template <class Owner>
  void add(const std::string& task, Owner* owner, Findings (Owner::*judge)(Values& values)) {
    updater_.add(task, [owner, judge](Status& status) {
      Values values;
      print((owner->*judge)(values), status);
      for (const auto& [name, value] : values.all()) status.add(name, value);
    });
  }

  /// The first finding, and the faults among the others.
  static void print(const Findings& findings, Status& status);

 private:
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

/// /diagnostics of the image side. Tasks: rate, synchronisation, exposure, features, load.
class ImageDiagnostics {
 public:
  ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                   const StereoInputOptions& options, ArrivalLog& arrivals, UnusedInput& unused);

  WorkLoad& load() { return load_; }
  /// For each processed pair; for each that could not be processed, with the reason.
  void note(const StereoFeatures& features);
  void noteFailure(const std::string& why);

 private:
  Findings judgeSynchronisation(Values& values);
  Findings judgeExposure(Values& values);
  Findings judgeFeatures(Values& values);

  const ImageThresholds thresholds_;
  ArrivalLog& arrivals_;
  UnusedInput& unused_;
  WorkLoad load_;

  std::mutex mutex_;
  std::optional<ExtractionReport> last_;
  int last_count_ = 0;  ///< of features
  ExposureTurns exposures_;
  std::string failure_;
  RefusalCheck refusals_;  ///< since the last call of the task

  WallUpdater updater_;
};

/// /diagnostics of the odometry. Tasks: its state in vo_info, rate of its input, load, latency.
class OdometryDiagnostics {
 public:
  OdometryDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                      const OdometryOutputOptions& options, UnusedInput& unused);

  InputMonitor& input() { return input_; }
  WorkLoad& load() { return load_; }
  /// Of each pair, as published.
  void note(const stereo_descriptor_vo::VoInfo& info);

 private:
  Findings judge(Values& values);
  Findings judgeInput(Values& values);
  Findings judgeLatency(Values& values);
  void addValues(Values& values) const;

  const double max_latency_;
  UnusedInput& unused_;
  InputMonitor input_;
  WorkLoad load_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::VoInfo> last_;

  WallUpdater updater_;
};

/// /diagnostics of the place recognition.
class PlaceDiagnostics {
 public:
  /// `max_silence`: s, wall time. `input`: names of the topics of its input.
  PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name, const std::string& input,
                   double max_silence, UnusedInput& unused);

  /// Of pairs with odometry.
  InputMonitor& input() { return input_; }
  /// Of each key frame, as published.
  void note(const stereo_descriptor_vo::PlaceInfo& info);
  /// The session began anew, with no places or with loaded ones.
  void restart();

 private:
  Findings judge(Values& values);

  UnusedInput& unused_;
  InputMonitor input_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::PlaceInfo> last_;

  WallUpdater updater_;
};

}  // namespace sdvo
