#pragma once

#include <random>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/motion/minimal_sampling.hpp"
#include "stereo_descriptor_vo/motion/pose_problem.hpp"

namespace sdvo {

struct GeneticConsensusOptions {
  int population = 24;
  double mutation_rate = 0.1;
  bool learning = true;  ///< adaptive: how good a replacement each gene is

  void describe(OptionList& list) {
    list.add("population", population, {4, 1000}, "", "gasac: individuals of a generation");
    list.add("mutation_rate", mutation_rate, {0.0, 1.0}, "", "gasac: share of a child's genes replaced at random");
  }
};

/// A hypothesis of the search and what it cost.
struct GeneticResult {
  bool found = false;
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  double cost = 0.0;   ///< PoseProblem::truncatedCost
  int iterations = 0;  ///< minimal samples solved
};

/// Genetic algorithm sample consensus. An individual is a minimal sample, its genes are the correspondences, its
/// fitness is the consensus of its pose. With `adaptive` false the rates are fixed (GASAC, Rodehorst and Hellwich
/// 2006). With `adaptive` true unfit individuals are mutated. The search learns for each gene how good a replacement it
/// is: as good as the best pose it agrees with. Mutation so moves from random exploration to exploitation (Shojaedini,
/// Majd, Safabakhsh 2017).
GeneticResult searchGenetically(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive,
                                SampleBudget budget, std::mt19937& random);

}  // namespace sdvo
