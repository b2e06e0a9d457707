#pragma once

#include "experiment_setup.hpp"

namespace sdvo {

/// Experiment C of the paper: errors of frame-to-frame odometry over runs that differ in the seed alone.
struct AccuracyExperiment {
  int features = 2320;
  double standard_size = 7.0;  ///< px
  int seeds = 20;              ///< runs, seeded 1, 2, …
  std::vector<ConsensusMethod> methods = {ConsensusMethod::kAdaptiveGasac, ConsensusMethod::kRansac,
                                          ConsensusMethod::kMsac};
  bool package_odometry = false;  ///< also the package's odometry on the same features
};

/// Writes accuracy.csv (a row for each run) and accuracy_summary.csv (table 2) to the output directory; returns the
/// latter as text. Errors are against the ground truth, means over sub-paths of 5, 10 … 50 m.
std::string runAccuracy(const ExperimentSetup& setup, const AccuracyExperiment& experiment);

}  // namespace sdvo
