#pragma once

#include "experiment_setup.hpp"

namespace sdvo {

/// Experiment B of the paper: inliers of the motion between pairs that lie several steps apart.
struct RobustnessExperiment {
  int features = 2320;
  double standard_size = 7.0;  ///< px
  int stride = 2;              ///< pairs between two starts
  int seeds = 1;               ///< runs of the sample consensus, seeded 1, 2, …
};

/// Writes robustness_steps.csv, sums over the runs of each sequence, system and step, to the output directory.
void runRobustness(const ExperimentSetup& setup, const RobustnessExperiment& experiment);

}  // namespace sdvo
