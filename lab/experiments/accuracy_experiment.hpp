#pragma once

#include "experiment_setup.hpp"

namespace sdvo {

/// Experiment C of the paper: errors of the motion between pairs that lie several steps apart, over runs that differ in
/// the seed alone.
struct AccuracyExperiment {
  std::vector<int> feature_counts = {400, 2320};
  double standard_size = 7.0;                                 ///< px
  int seeds = 20;                                             ///< runs, seeded 1, 2, …
  std::vector<std::string> systems = {"standard", "stereo"};  ///< by name; the standard one is among them
  std::vector<ConsensusMethod> methods = {ConsensusMethod::kAdaptiveGasac};
  bool without_rig_error = false;  ///< take out of the disparities what the package's odometry says of the rig's error
};

/// Writes accuracy.csv, a row for each run, to the output directory. Errors are against the ground truth.
void runAccuracy(const ExperimentSetup& setup, const AccuracyExperiment& experiment);

}  // namespace sdvo
