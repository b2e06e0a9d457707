#include <gtest/gtest.h>

#include "../../src/motion/sample_consensus.hpp"
#include "seen_points.hpp"

namespace sdvo::test_genetic_consensus {

constexpr double kCertainty = 1.0;  // never reached: the whole budget is used
constexpr double kNone = 0.0;       // reached with the first pose

Consensus search(const SeenPoints& scene, const GeneticConsensusOptions& options, bool adaptive, int iterations,
                 unsigned seed, double confidence = kCertainty) {
  const PoseProblem problem(scene.camera, scene.correspondences, 2.0);
  std::mt19937 random(seed);
  return searchGenetically(problem, options, adaptive, {iterations, confidence}, random);
}

bool equal(const Consensus& a, const Consensus& b) {
  return a.cost == b.cost && a.iterations == b.iterations &&
         a.T_current_reference.matrix() == b.T_current_reference.matrix();
}

TEST(GeneticSearch, UsesItsBudgetExactlyAndStopsWhenConfident) {
  const SeenPoints scene = seenPoints(1, 150, 0.3, 0.5);
  for (const bool adaptive : {false, true}) {
    for (const int iterations : {1, 10, 24, 25, 137})
      EXPECT_EQ(search(scene, {}, adaptive, iterations, 1).iterations, iterations) << adaptive;
    const Consensus confident = search(scene, {}, adaptive, 1000, 1, kNone);
    EXPECT_TRUE(confident.found);
    EXPECT_LE(confident.iterations, 3);
  }
}

TEST(GeneticSearch, TheCostIsThatOfThePose) {
  const SeenPoints scene = seenPoints(2, 150, 0.3, 0.6);
  const PoseProblem problem(scene.camera, scene.correspondences, 2.0);
  for (const bool adaptive : {false, true}) {
    const Consensus result = search(scene, {}, adaptive, 300, 3);
    ASSERT_TRUE(result.found);
    EXPECT_EQ(result.cost, problem.truncatedCost(result.T_current_reference));
    EXPECT_LT(result.cost, problem.worstCost());
  }
}

/// The ablation: learning steers the adaptive search, and only that one.
TEST(GeneticSearch, LearningSteersTheAdaptiveSearchAlone) {
  const SeenPoints scene = seenPoints(4, 150, 0.3, 0.7);
  GeneticConsensusOptions without;
  without.learning = false;
  int different = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    different += !equal(search(scene, {}, true, 300, seed), search(scene, without, true, 300, seed));
    EXPECT_TRUE(equal(search(scene, {}, false, 300, seed), search(scene, without, false, 300, seed)));
  }
  EXPECT_GT(different, 0);
}

/// What was learnt is worth something: with many outliers and few samples, the motion is found more often.
TEST(GeneticSearch, LearningFindsTheMotionMoreOften) {
  GeneticConsensusOptions without;
  without.learning = false;
  int found_with = 0, found_without = 0;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    const SeenPoints scene = seenPoints(100 + seed, 150, 0.3, 0.8);
    const PoseProblem problem(scene.camera, scene.correspondences, 2.0);
    const double right = 1.05 * problem.truncatedCost(trueMotion());
    found_with += search(scene, {}, true, 150, seed).cost < right;
    found_without += search(scene, without, true, 150, seed).cost < right;
  }
  // Each is a number of successes with a standard deviation of at most 6.
  EXPECT_GT(found_with, found_without + 6);
}

}  // namespace sdvo::test_genetic_consensus
