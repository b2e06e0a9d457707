#pragma once

#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"

namespace sdvo {

/// Whose motion is taken for true.
enum class ReferenceMotion { kGroundTruth, kOdometry };

inline const std::vector<std::string>& namesOf(ReferenceMotion) {
  static const std::vector<std::string> names = {"ground_truth", "odometry"};
  return names;
}

/// What all experiments on sequences share.
struct ExperimentSetup {
  std::string kitti;                   ///< directory that holds sequences/NN
  std::vector<std::string> sequences;  ///< NN below kitti, or directories in KITTI layout
  std::string output;                  ///< directory for CSV and PNG
  ReferenceMotion reference = ReferenceMotion::kOdometry;
  int frames = 0;                     ///< pairs used of each sequence; 0: all
  std::vector<std::string> settings;  ///< name=value of the package's options

  /// The package's options with the experiments' own defaults (a detector that finds loosely enough for the largest
  /// feature set, FREAK's curve, neighbourhoods that go on beyond the border) and, above all, `settings`.
  PipelineOptions options() const;
};

}  // namespace sdvo
