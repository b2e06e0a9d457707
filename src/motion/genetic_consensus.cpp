#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "sample_consensus.hpp"

namespace sdvo {
namespace {

struct Individual {
  MinimalSample genes{};
  double cost = std::numeric_limits<double>::max();
};

double uniform(std::mt19937& random) {
  return static_cast<double>(random()) / 4294967296.0;
}

bool contains(const MinimalSample& genes, int gene) {
  return std::find(genes.begin(), genes.end(), gene) != genes.end();
}

/// Learnt quality of each correspondence: the fitness of the best pose that it agrees with. The abstract of the 2017
/// paper leaves open what is learnt. The fitness of a sample rates its three genes alone, and most genes are never
/// drawn; the inliers of its pose rate all correspondences. Poses below the average agree by chance and are ignored.
class GeneKnowledge {
 public:
  explicit GeneKnowledge(int count) : quality_(static_cast<std::size_t>(count), 0.0) {}

  /// Takes note of a pose of the given fitness, 0…1; `inliers` lists the genes that agree with it and is called when
  /// needed.
  template <class Inliers>
  void learn(double fitness, const Inliers& inliers) {
    if (fitness * poses_ > sum_) {
      for (const int gene : inliers()) {
        double& quality = quality_[gene];
        quality = std::max(quality, fitness);
      }
    }
    sum_ += fitness;
    ++poses_;
  }

  /// The best of a few genes drawn at random (tournament selection): always the best one would repeat samples.
  int drawGood(std::mt19937& random) const {
    constexpr int kTournament = 8;
    std::size_t best = random() % quality_.size();
    for (int k = 1; k < kTournament; ++k) {
      const std::size_t rival = random() % quality_.size();
      if (quality_[rival] > quality_[best]) best = rival;
    }
    return static_cast<int>(best);
  }

 private:
  std::vector<double> quality_;
  double sum_ = 0.0, poses_ = 0.0;  ///< of the fitness, and how many
};

class GeneticSearch {
 public:
  GeneticSearch(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive, SampleBudget budget,
                std::mt19937& random)
      : problem_(problem),
        options_(options),
        adaptive_(adaptive),
        budget_(budget),
        random_(random),
        knowledge_(problem.count()) {}

  Consensus run() {
    result_.cost = std::numeric_limits<double>::max();
    std::vector<Individual> population(GeneticConsensusOptions::kPopulation);
    for (Individual& individual : population) {
      individual.genes = drawSample(random_, problem_.count());
      evaluate(individual);
      if (finished()) return result_;
    }
    while (!finished()) nextGeneration(population);
    return result_;
  }

 private:
  bool finished() const { return budget_.spent(result_.iterations); }

  void evaluate(Individual& individual) {
    ++result_.iterations;
    // An individual that gives no pose at all is as unfit as one that no correspondence agrees with.
    individual.cost = std::numeric_limits<double>::max();
    std::optional<Eigen::Isometry3d> fittest;
    for (const Eigen::Isometry3d& T : problem_.solve(individual.genes)) {
      const double cost = problem_.truncatedCost(T);
      if (cost < individual.cost) {
        individual.cost = cost;
        fittest = T;
      }
      if (cost >= result_.cost) continue;
      result_.found = true;
      result_.cost = cost;
      result_.T_current_reference = T;
      budget_.noteInliers(static_cast<double>(problem_.inliers(T).size()) / problem_.count());
    }
    if (adaptive_ && options_.learning && fittest)
      knowledge_.learn(1.0 - individual.cost / problem_.worstCost(), [&] { return problem_.inliers(*fittest); });
  }

  /// The fitter half become parents; their children replace the unfit half.
  void nextGeneration(std::vector<Individual>& population) {
    std::stable_sort(population.begin(), population.end(),
                     [](const Individual& a, const Individual& b) { return a.cost < b.cost; });
    const std::size_t parents = population.size() / 2;
    for (std::size_t i = parents; i < population.size() && !finished(); ++i) {
      Individual& unfit = population[i];
      if (adaptive_ && i % 2 == 0) {
        mutateUnfit(unfit.genes);
      } else {
        unfit.genes = cross(population[random_() % parents].genes, population[random_() % parents].genes);
        if (!adaptive_) mutateAtFixedRate(unfit.genes);
      }
      evaluate(unfit);
    }
  }

  /// Each gene comes from either parent, but none twice. A child that equals its mother gets a random gene.
  MinimalSample cross(const MinimalSample& mother, const MinimalSample& father) {
    MinimalSample child = mother;
    for (std::size_t g = 0; g < child.size(); ++g)
      if (random_() % 2 == 0 && !contains(child, father[g])) child[g] = father[g];
    if (child == mother) replace(child, random_() % child.size(), false);
    return child;
  }

  void mutateAtFixedRate(MinimalSample& genes) {
    for (std::size_t g = 0; g < genes.size(); ++g)
      if (uniform(random_) < GeneticConsensusOptions::kMutationRate) replace(genes, g, false);
  }

  /// All genes of an unfit individual are replaced: at random in the beginning, by the best known ones in the end.
  void mutateUnfit(MinimalSample& genes) {
    for (std::size_t g = 0; g < genes.size(); ++g)
      replace(genes, g, options_.learning && uniform(random_) < budget_.progress(result_.iterations));
  }

  void replace(MinimalSample& genes, std::size_t g, bool exploit) {
    int gene = genes[g];
    while (contains(genes, gene))
      gene = exploit ? knowledge_.drawGood(random_)
                     : static_cast<int>(random_() % static_cast<unsigned>(problem_.count()));
    genes[g] = gene;
  }

  const PoseProblem& problem_;
  const GeneticConsensusOptions& options_;
  const bool adaptive_;
  SampleBudget budget_;
  std::mt19937& random_;
  GeneKnowledge knowledge_;
  Consensus result_;
};

}  // namespace

Consensus searchGenetically(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive,
                            SampleBudget budget, std::mt19937& random) {
  return GeneticSearch(problem, options, adaptive, budget, random).run();
}

}  // namespace sdvo
