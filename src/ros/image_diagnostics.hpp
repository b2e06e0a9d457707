#pragma once

#include <ros/node_handle.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "../config/interface_options.hpp"
#include "input_monitor.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "wall_updater.hpp"
#include "work_load.hpp"

namespace sdvo {

/// /diagnostics of the image side, one task for each thing that goes wrong with cameras: rate, synchronisation,
/// exposure, corners, load.
class ImageDiagnostics {
 public:
  ImageDiagnostics(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name,
                   const StereoInputOptions& options);

  InputMonitor& input() { return input_; }
  WorkLoad& load() { return load_; }
  /// Of each pair that came together: how far its stamps are apart, s.
  void notePair(double gap);
  /// Of each pair that was processed, and of each that could not be, why.
  void note(const StereoFeatures& features);
  void noteFailure(const std::string& why);
  /// Messages that were refused or came late, since the start.
  void noteUnused(std::uint64_t refused, std::uint64_t out_of_order);

 private:
  using Status = WallUpdater::Status;

  void diagnoseSynchronisation(Status& status);
  void diagnoseExposure(Status& status);
  void diagnoseFeatures(Status& status);
  bool isIdle(Status& status) const;

  const ImageThresholds thresholds_;
  InputMonitor input_;
  WorkLoad load_;

  std::mutex mutex_;
  double largest_gap_ = 0.0;  ///< s, since the task was asked last
  std::uint64_t refused_ = 0, out_of_order_ = 0, reported_ = 0;
  std::optional<ExtractionReport> last_;
  int last_count_ = 0;  ///< of features
  std::string failure_;
  int pairs_ = 0, refused_pairs_ = 0;  ///< since the task was asked last

  WallUpdater updater_;
};

}  // namespace sdvo
