#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"

namespace sdvo {

/// What all experiments on sequences share.
struct ExperimentSetup {
  std::string kitti;                   ///< directory that holds sequences/NN
  std::vector<std::string> sequences;  ///< NN below kitti, or directories in KITTI layout
  std::string output;                  ///< directory for CSV and PNG
  std::string reference = "odometry";  ///< "ground_truth" or "odometry"
  int frames = 0;                      ///< pairs used of each sequence; 0: all
  std::vector<std::string> settings;   ///< name=value of the package's options

  /// The package's options with the experiments' own defaults (a detector that finds loosely enough for the largest
  /// feature set, FREAK's curve, neighbourhoods that go on beyond the border) and, above all, `settings`.
  PipelineOptions options() const;
};

/// A sequence and the motion taken for true.
struct ReferenceSequence {
  std::string name;
  KittiSequence images;
  int frames = 0;         ///< pairs used
  Trajectory trajectory;  ///< T_world_camera of each pair used

  Eigen::Isometry3d motion(int from, int to) const {
    return trajectory[static_cast<std::size_t>(to)].inverse() * trajectory[static_cast<std::size_t>(from)];
  }
};

/// Opens a sequence of the setup. With `reference` "ground_truth" its poses are read; with "odometry" the package's
/// odometry is run over it. Throws std::runtime_error that names what is missing.
ReferenceSequence openSequence(const ExperimentSetup& setup, const std::string& name, const std::string& reference);

/// The same without a trajectory.
ReferenceSequence openImages(const ExperimentSetup& setup, const std::string& name);

/// Mutual nearest neighbours on descriptors alone: no gating, no limit of the distance.
std::vector<FeatureMatch> matchByDescriptor(const StereoFeatures& reference, const StereoFeatures& current);

/// Number of matches whose 3-D point of the reference pair, moved by T_current_reference, reprojects within 3 px of the
/// matched key point in the left image.
int countCorrect(const StereoFeatures& reference, const StereoFeatures& current,
                 const std::vector<FeatureMatch>& matches, const Eigen::Isometry3d& T_current_reference);

}  // namespace sdvo
