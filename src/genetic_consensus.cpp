#include "stereo_descriptor_vo/genetic_consensus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace sdvo {
namespace {

struct Individual {
  MinimalSample genes{};
  double cost = std::numeric_limits<double>::max();
};

double uniform(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0; }

bool contains(const MinimalSample& genes, int gene) {
  return std::find(genes.begin(), genes.end(), gene) != genes.end();
}

/// What mutation has learnt of each correspondence: the mean fitness of the individuals it took part in. A gene that was
/// never tried counts as average, so that it stays in the game.
class GeneKnowledge {
 public:
  explicit GeneKnowledge(int count) : sum_(static_cast<std::size_t>(count), 0.0), tries_(sum_.size(), 0.0) {}

  void learn(const MinimalSample& genes, double fitness) {
    for (const int gene : genes) {
      sum_[static_cast<std::size_t>(gene)] += fitness;
      ++tries_[static_cast<std::size_t>(gene)];
    }
    total_ += fitness;
    ++individuals_;
  }

  /// The best of a few genes drawn at random (tournament selection): exploitation that never repeats itself blindly.
  int drawGood(std::mt19937& random) const {
    constexpr int kTournament = 8;
    int best = static_cast<int>(random() % sum_.size());
    for (int k = 1; k < kTournament; ++k) {
      const int rival = static_cast<int>(random() % sum_.size());
      if (quality(rival) > quality(best)) best = rival;
    }
    return best;
  }

 private:
  double quality(int gene) const {
    const double prior = individuals_ > 0.0 ? total_ / individuals_ : 0.0;
    return (sum_[static_cast<std::size_t>(gene)] + prior) / (tries_[static_cast<std::size_t>(gene)] + 1.0);
  }

  std::vector<double> sum_, tries_;
  double total_ = 0.0, individuals_ = 0.0;
};

class GeneticSearch {
 public:
  GeneticSearch(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive,
                const SearchBudget& budget, std::mt19937& random)
      : problem_(problem),
        options_(options),
        adaptive_(adaptive),
        budget_(budget),
        random_(random),
        knowledge_(problem.count()),
        needed_(budget.max_iterations) {}

  GeneticResult run() {
    result_.cost = std::numeric_limits<double>::max();
    std::vector<Individual> population(static_cast<std::size_t>(options_.population));
    for (Individual& individual : population) {
      individual.genes = drawSample(random_, problem_.count());
      evaluate(individual);
      if (finished()) return result_;
    }
    while (!finished()) nextGeneration(population);
    return result_;
  }

 private:
  bool finished() const {
    return result_.iterations >= budget_.max_iterations ||
           result_.iterations >= std::max<double>(needed_, budget_.min_iterations);
  }

  /// Share of the budget that is used up, 0…1.
  double progress() const {
    return std::min(1.0, result_.iterations / std::max(1.0, std::min<double>(needed_, budget_.max_iterations)));
  }

  void evaluate(Individual& individual) {
    ++result_.iterations;
    // An individual that gives no pose at all is as unfit as one that no correspondence agrees with.
    individual.cost = std::numeric_limits<double>::max();
    for (const Eigen::Isometry3d& T : problem_.solve(individual.genes)) {
      const double cost = problem_.truncatedCost(T);
      individual.cost = std::min(individual.cost, cost);
      if (cost >= result_.cost) continue;
      result_.found = true;
      result_.cost = cost;
      result_.T_current_reference = T;
      const double inliers = static_cast<double>(problem_.inliers(T).size());
      needed_ = budget_.needed(inliers / problem_.count(), budget_.confidence);
    }
    if (adaptive_ && options_.learning) {
      const double worst = problem_.worstCost();
      knowledge_.learn(individual.genes, std::max(0.0, 1.0 - individual.cost / worst));
    }
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

  /// Each gene comes from either parent; the same gene twice is replaced at random.
  MinimalSample cross(const MinimalSample& mother, const MinimalSample& father) {
    MinimalSample child = mother;
    for (std::size_t g = 0; g < child.size(); ++g)
      if (random_() % 2 == 0 && !contains(child, father[g])) child[g] = father[g];
    if (child == mother) replace(child, random_() % child.size(), false);
    return child;
  }

  void mutateAtFixedRate(MinimalSample& genes) {
    for (std::size_t g = 0; g < genes.size(); ++g)
      if (uniform(random_) < options_.mutation_rate) replace(genes, g, false);
  }

  /// All genes of an unfit individual are replaced: at random in the beginning, by the best known ones in the end.
  void mutateUnfit(MinimalSample& genes) {
    for (std::size_t g = 0; g < genes.size(); ++g) replace(genes, g, options_.learning && uniform(random_) < progress());
  }

  void replace(MinimalSample& genes, std::size_t g, bool exploit) {
    int gene = genes[g];
    while (contains(genes, gene))
      gene = exploit ? knowledge_.drawGood(random_) : static_cast<int>(random_() % static_cast<unsigned>(problem_.count()));
    genes[g] = gene;
  }

  const PoseProblem& problem_;
  const GeneticConsensusOptions& options_;
  const bool adaptive_;
  const SearchBudget& budget_;
  std::mt19937& random_;
  GeneKnowledge knowledge_;
  double needed_;
  GeneticResult result_;
};

}  // namespace

MinimalSample drawSample(std::mt19937& random, int count) {
  MinimalSample sample{};
  for (std::size_t k = 0; k < sample.size();) {
    sample[k] = static_cast<int>(random() % static_cast<unsigned>(count));
    if (std::find(sample.begin(), sample.begin() + k, sample[k]) == sample.begin() + k) ++k;
  }
  return sample;
}

GeneticResult searchGenetically(const PoseProblem& problem, const GeneticConsensusOptions& options, bool adaptive,
                                const SearchBudget& budget, std::mt19937& random) {
  return GeneticSearch(problem, options, adaptive, budget, random).run();
}

}  // namespace sdvo
