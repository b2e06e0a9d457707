#include "sample_consensus.hpp"

#include <algorithm>
#include <cmath>
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
  consensus.cost = std::numeric_limits<double>::max();
  for (; !budget.spent(consensus.iterations); ++consensus.iterations) {
    for (const Eigen::Isometry3d& candidate : problem.solve(drawSample(random, problem.count()))) {
      double cost = count_only ? problem.outlierCost(candidate, consensus.cost)
                               : problem.truncatedCost(candidate, consensus.cost);
      if (cost >= consensus.cost) continue;
      consensus.found = true;
      consensus.T_current_reference = candidate;
      if (local) optimiseLocally(problem, refinement, consensus.T_current_reference, cost);
      consensus.cost = cost;
      const double inliers = static_cast<double>(problem.inliers(consensus.T_current_reference).size());
      budget.noteInliers(inliers / problem.count());
    }
  }
  return consensus;
}

}  // namespace

MinimalSample drawSample(std::mt19937& random, int count) {
  MinimalSample sample{};
  for (std::size_t k = 0; k < sample.size();) {
    sample[k] = static_cast<int>(random() % static_cast<unsigned>(count));
    if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
  }
  return sample;
}

SampleBudget::SampleBudget(int at_most, double confidence)
    : at_most_(at_most), confidence_(confidence), needed_(at_most) {}

void SampleBudget::noteInliers(double ratio) {
  const double all_inliers = ratio * ratio * ratio;  // probability of such a sample (Fischler and Bolles 1981)
  needed_ = std::max(1.0, std::log(1.0 - confidence_) / std::log1p(-all_inliers));
}

bool SampleBudget::spent(int samples) const {
  return samples >= std::min(needed_, at_most_);
}

double SampleBudget::progress(int samples) const {
  return std::min(1.0, samples / std::max(1.0, std::min(needed_, at_most_)));
}

Consensus findConsensus(const PoseProblem& problem, const SampleConsensusOptions& options,
                        const MotionRefinementOptions& refinement) {
  constexpr int kSmallestProblem = 4;  // the genetic search needs a gene to exchange
  if (problem.count() < kSmallestProblem) return {};
  std::mt19937 random(static_cast<std::uint32_t>(options.seed));
  const SampleBudget budget(options.max_iterations, 1.0 - kTailProbability);
  const bool adaptive = options.consensus == ConsensusMethod::kAdaptiveGasac;
  if (adaptive || options.consensus == ConsensusMethod::kGasac)
    return searchGenetically(problem, options.genetic, adaptive, budget, random);
  return searchAtRandom(problem, options, refinement, budget, random);
}

}  // namespace sdvo
