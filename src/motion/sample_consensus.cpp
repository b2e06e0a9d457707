#include "stereo_descriptor_vo/motion/sample_consensus.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace sdvo {
namespace {

/// Local optimisation of a new best pose over its own inliers (Chum, Matas, Kittler 2003).
void optimiseLocally(const PoseProblem& problem, MotionRefinementOptions refinement, Eigen::Isometry3d& T,
                     double& cost) {
  constexpr int kFewSteps = 3;
  refinement.refinement_iterations = std::min(refinement.refinement_iterations, kFewSteps);
  Eigen::Isometry3d optimised = T;
  refineMotion(problem.camera(), refinement, problem.correspondences(), problem.inliers(T), optimised);
  const double optimised_cost = problem.truncatedCost(optimised, cost);
  if (optimised_cost >= cost) return;
  T = optimised;
  cost = optimised_cost;
}

Consensus searchAtRandom(const PoseProblem& problem, const SampleConsensusOptions& options,
                         const MotionRefinementOptions& refinement, SampleBudget budget, std::mt19937& random) {
  const bool count_only = options.consensus == ConsensusMethod::kRansac;
  const bool local = options.consensus == ConsensusMethod::kLoRansac;
  Consensus consensus;
  double best = std::numeric_limits<double>::max();
  for (; !budget.spent(consensus.iterations); ++consensus.iterations) {
    for (const Eigen::Isometry3d& candidate : problem.solve(drawSample(random, problem.count()))) {
      double cost = count_only ? problem.outlierCost(candidate, best) : problem.truncatedCost(candidate, best);
      if (cost >= best) continue;
      consensus.found = true;
      consensus.T_current_reference = candidate;
      if (local) optimiseLocally(problem, refinement, consensus.T_current_reference, cost);
      best = cost;
      const double inliers = static_cast<double>(problem.inliers(consensus.T_current_reference).size());
      budget.noteInliers(inliers / problem.count());
    }
  }
  return consensus;
}

Consensus searchByGenes(const PoseProblem& problem, const SampleConsensusOptions& options, const SampleBudget& budget,
                        std::mt19937& random) {
  const GeneticResult result =
      searchGenetically(problem, options.genetic, options.consensus == ConsensusMethod::kAdaptiveGasac, budget, random);
  Consensus consensus;
  consensus.found = result.found;
  consensus.T_current_reference = result.T_current_reference;
  consensus.iterations = result.iterations;
  return consensus;
}

}  // namespace

Consensus findConsensus(const PoseProblem& problem, const SampleConsensusOptions& options,
                        const MotionRefinementOptions& refinement) {
  constexpr int kSmallestProblem = 4;  // the genetic search needs a gene to exchange
  if (problem.count() < kSmallestProblem) return {};
  std::mt19937 random(static_cast<std::uint32_t>(options.seed));
  const bool genetic =
      options.consensus == ConsensusMethod::kGasac || options.consensus == ConsensusMethod::kAdaptiveGasac;
  const SampleBudget budget(options.max_iterations, 1.0 - kTailProbability);
  return genetic ? searchByGenes(problem, options, budget, random)
                 : searchAtRandom(problem, options, refinement, budget, random);
}

}  // namespace sdvo
