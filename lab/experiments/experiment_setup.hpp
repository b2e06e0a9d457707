#pragma once

#include <string>
#include <vector>

#include "../../src/config/pipeline_options.hpp"

namespace sdvo {

/// Whose motion is taken for true.
enum class ReferenceMotion { kGroundTruth, kOdometry };

inline const std::vector<std::string>& namesOf(ReferenceMotion) {
  static const std::vector<std::string> names = {"ground_truth", "odometry"};
  return names;
}

/// The package's own way to find and describe features, or the one of the paper and its tools of 2017.
enum class Setup { kProduct, kPaper };

inline const std::vector<std::string>& namesOf(Setup) {
  static const std::vector<std::string> names = {"product", "paper"};
  return names;
}

/// One difference between the set-ups, or from both of them.
struct SetupDifference {
  std::string name;
  std::vector<std::string> with, without;  ///< name=value
  bool of_freak = false;                   ///< does not concern another base descriptor
};

/// Differences of the paper's set-up from the product's.
const std::vector<SetupDifference>& paperDifferences();

/// Further differences whose effect the ablation measures; neither set-up has them.
const std::vector<SetupDifference>& otherDifferences();

/// A set-up with one thing changed.
struct Ablation {
  Setup setup;
  std::string change;                 ///< "as it is", "with NAME", "without NAME"
  std::vector<std::string> settings;  ///< name=value
};

std::vector<Ablation> ablations();

/// The pipeline's options, and what only experiments can set.
struct ExperimentOptions : PipelineOptions {
  double noise = 0.0;   ///< grey levels that FAST's min_contrast multiplies in every image; 0: each image's own noise
  bool tracks = false;  ///< finds corners in the right image by tracking (paper, section 4), not by a search of rows
};

/// What all experiments on sequences share.
struct ExperimentSetup {
  std::string kitti;                   ///< directory that holds sequences/NN
  std::vector<std::string> sequences;  ///< NN below kitti, or directories in KITTI layout
  std::string output;                  ///< directory for CSV and PNG
  ReferenceMotion reference = ReferenceMotion::kOdometry;
  Setup setup = Setup::kProduct;
  int frames = 0;                     ///< pairs used of each sequence; 0: all
  std::vector<std::string> settings;  ///< name=value of the package's options

  /// Options by which the detector finds enough corners for the largest feature set; the differences of the set-up;
  /// and, above all, `settings`. All others are the nodelets'. The paper's set-up has detector and tolerances of its
  /// own.
  ExperimentOptions options() const;

  /// The same with another base descriptor.
  ExperimentSetup withDescriptor(DescriptorType type) const;
};

}  // namespace sdvo
