#pragma once

#include "experiment_setup.hpp"

namespace sdvo {

/// Experiment A of the paper: correct matches of scale normalised descriptors against the standard ones.
struct MatchingExperiment {
  std::vector<DescriptorType> descriptors = {DescriptorType::kFreak, DescriptorType::kSift};
  std::vector<DescriptorLayout> layouts = {DescriptorLayout::kLeft, DescriptorLayout::kLeftAndRight};
  std::vector<int> feature_counts = {310, 1350, 2320};
  std::vector<double> tolerances = {1.0, 2.0, 3.0};         ///< px, within which a match is correct
  double standard_size = 7.0;                               ///< px
  std::vector<double> constant_sizes = {10.0, 14.0, 20.0};  ///< px, candidates beside the standard for the best one
};

/// Writes matching_steps.csv, correct matches of each sequence, size and step, to the output directory.
void runMatching(const ExperimentSetup& setup, const MatchingExperiment& experiment);

}  // namespace sdvo
