#include "stereo_descriptor_vo/odometry/sample_consensus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stereo_descriptor_vo/odometry/motion_refinement.hpp"

namespace sdvo {
namespace {

/// Samples needed to draw one without outliers at the wanted confidence (Fischler and Bolles 1981).
double neededIterations(double inlier_ratio, double confidence) {
  const double all_inliers = std::pow(inlier_ratio, 3);
  if (all_inliers >= 1.0) return 1.0;
  if (all_inliers <= 1e-12) return std::numeric_limits<double>::max();
  return std::log(1.0 - confidence) / std::log(1.0 - all_inliers);
}

/// Local optimisation of a new best pose over its own inliers (Chum, Matas, Kittler 2003).
void optimiseLocally(const PoseProblem& problem, Eigen::Isometry3d& T, double& cost) {
  MotionRefinementOptions few_steps;
  few_steps.refinement_iterations = 3;
  Eigen::Isometry3d optimised = T;
  refineMotion(problem.camera(), few_steps, problem.correspondences(), problem.inliers(T), optimised);
  const double optimised_cost = problem.truncatedCost(optimised, cost);
  if (optimised_cost >= cost) return;
  T = optimised;
  cost = optimised_cost;
}

Consensus searchAtRandom(const PoseProblem& problem, const SampleConsensusOptions& options, std::mt19937& random) {
  const bool count_only = options.consensus == "ransac";
  const bool local = options.consensus == "lo_ransac";
  Consensus consensus;
  double best = std::numeric_limits<double>::max(), needed = options.max_iterations;
  const auto unfinished = [&] {
    return consensus.iterations < options.max_iterations &&
           consensus.iterations < std::max<double>(needed, options.min_iterations);
  };
  for (; unfinished(); ++consensus.iterations) {
    for (const Eigen::Isometry3d& candidate : problem.solve(drawSample(random, problem.count()))) {
      double cost = count_only ? problem.outlierCost(candidate, best) : problem.truncatedCost(candidate, best);
      if (cost >= best) continue;
      consensus.found = true;
      consensus.T_current_reference = candidate;
      if (local) optimiseLocally(problem, consensus.T_current_reference, cost);
      best = cost;
      const double inliers = static_cast<double>(problem.inliers(consensus.T_current_reference).size());
      needed = neededIterations(inliers / problem.count(), options.confidence);
    }
  }
  return consensus;
}

Consensus searchByGenes(const PoseProblem& problem, const SampleConsensusOptions& options, std::mt19937& random) {
  const SearchBudget budget{options.min_iterations, options.max_iterations, options.confidence, neededIterations};
  const GeneticResult result =
      searchGenetically(problem, options.genetic, options.consensus == "adaptive_gasac", budget, random);
  Consensus consensus;
  consensus.found = result.found;
  consensus.T_current_reference = result.T_current_reference;
  consensus.iterations = result.iterations;
  return consensus;
}

}  // namespace

Consensus findConsensus(const PoseProblem& problem, const SampleConsensusOptions& options) {
  constexpr int kSmallestProblem = 4;  // the genetic search needs a gene to exchange
  if (problem.count() < kSmallestProblem) return {};
  std::mt19937 random(static_cast<std::uint32_t>(options.seed));
  const bool genetic = options.consensus == "gasac" || options.consensus == "adaptive_gasac";
  Consensus consensus = genetic ? searchByGenes(problem, options, random) : searchAtRandom(problem, options, random);
  if (consensus.found) consensus.inliers = problem.inliers(consensus.T_current_reference);
  return consensus;
}

}  // namespace sdvo
