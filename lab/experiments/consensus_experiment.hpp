#pragma once

#include <string>
#include <vector>

#include "../../src/motion/sample_consensus.hpp"

namespace sdvo {

/// Outlier rejection by name on generated correspondences whose motion is known.
struct ConsensusExperiment {
  SampleConsensusOptions options;  ///< of every method
  int correspondences = 300;
  int seeds = 20;      ///< problems, seeded 1, 2, …; the search uses the same seed
  double noise = 0.4;  ///< standard deviation of each coordinate, px
  std::vector<int> outlier_percents = {10, 20, 30, 40, 50, 60, 70, 80};
  std::vector<int> budgets = {100, 500};  ///< most samples
};

/// Writes consensus.csv to `output`. A search succeeds when 95 % of the true inliers are within the
/// threshold of its refined pose and the pose is within 2 % of the motion's length and 0.2 deg.
void runConsensus(const ConsensusExperiment& experiment, const std::string& output);

}  // namespace sdvo
