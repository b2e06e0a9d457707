#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <mutex>
#include <optional>
#include <string>

#include "../../check/image_check.hpp"
#include "../../config/interface_options.hpp"
#include "arrival_log.hpp"
#include "diagnostic_tasks.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// `latency` of poses, s; negative for stamps in the future. `most`: the largest one that is no fault.
Finding checkLatency(double latency, double most);

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
  using Status = WallUpdater::Status;

  Findings judgeSynchronisation(Status& values);
  Findings judgeExposure(Status& values);
  Findings judgeFeatures(Status& values);

  const ImageThresholds thresholds_;
  ArrivalLog& arrivals_;
  UnusedInput& unused_;
  WorkLoad load_;

  std::mutex mutex_;
  std::optional<ExtractionReport> last_;
  int last_count_ = 0;  ///< of features
  ExposureTurns exposures_;
  std::string failure_, refused_status_;
  int pairs_ = 0, refused_pairs_ = 0;  ///< since the last call of the task

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
  using Status = WallUpdater::Status;

  Findings judge(Status& values);
  Findings judgeInput(Status& values);
  Findings judgeLatency(Status& values);
  void addValues(Status& values) const;

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
  using Status = WallUpdater::Status;

  Findings judge(Status& values);

  UnusedInput& unused_;
  InputMonitor input_;
  std::mutex mutex_;
  std::optional<stereo_descriptor_vo::PlaceInfo> last_;

  WallUpdater updater_;
};

}  // namespace sdvo
