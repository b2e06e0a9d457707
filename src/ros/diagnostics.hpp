#pragma once

#include <ros/node_handle.h>
#include <stereo_descriptor_vo/PlaceInfo.h>
#include <stereo_descriptor_vo/VoInfo.h>

#include <mutex>
#include <optional>
#include <string>

#include "../check/image_check.hpp"
#include "../config/interface_options.hpp"
#include "arrival_log.hpp"
#include "diagnostic_tasks.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// /diagnostics of the image side, one task for each thing that goes wrong with cameras: rate, synchronisation,
/// exposure, corners, load.
class ImageDiagnostics {
 public:
  ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                   const StereoInputOptions& options, ArrivalLog& arrivals, UnusedInput& unused);

  InputMonitor& input() { return input_; }
  WorkLoad& load() { return load_; }
  /// Of each pair that came together: the left stamp, ns, and how far it is from the right one, s.
  void notePair(std::int64_t stamp, double gap);
  /// Of each pair that was processed, and of each that could not be, why.
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
  InputMonitor input_;
  WorkLoad load_;

  std::mutex mutex_;
  double largest_gap_ = 0.0;  ///< s, since the task was asked last
  std::optional<ExtractionReport> last_;
  int last_count_ = 0;  ///< of features
  ExposureTurns exposures_;
  std::string failure_, refused_status_;
  int pairs_ = 0, refused_pairs_ = 0;  ///< since the task was asked last

  WallUpdater updater_;
};

/// /diagnostics of the odometry: its state as vo_info tells it, the rate of its input, its load and how late it is.
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
  /// `max_silence`: s, wall time. `input`: names of the topics that pairs come from.
  PlaceDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name, const std::string& input,
                   double max_silence, UnusedInput& unused);

  /// Of pairs with odometry.
  InputMonitor& input() { return input_; }
  /// Of each key frame, as published.
  void note(const stereo_descriptor_vo::PlaceInfo& info);
  /// Nothing is known any more, or what was loaded.
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
