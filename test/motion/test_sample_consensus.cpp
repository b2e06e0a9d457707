#include <gtest/gtest.h>

#include <set>

#include "../../src/motion/sample_consensus.hpp"
#include "seen_points.hpp"

namespace sdvo {

namespace test_minimal_sampling {

TEST(DrawSample, GivesDifferentIndicesAndLeavesNoneOut) {
  std::mt19937 random(1);
  std::set<int> seen;
  for (int k = 0; k < 200; ++k) {
    const MinimalSample sample = drawSample(random, 5);
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), 3u);
    seen.insert(sample.begin(), sample.end());
  }
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2, 3, 4}));
}

TEST(SampleBudget, IsWhatTheConfidenceNeeds) {
  // Half of all samples of three inliers in a hundred are drawn without an outlier with a chance of 1/8 each:
  // log(0.01) / log(7/8) = 34.5.
  SampleBudget budget(1000, 0.99);
  EXPECT_FALSE(budget.spent(999)) << "nothing is known of the inliers yet";
  EXPECT_TRUE(budget.spent(1000));
  budget.noteInliers(0.5);
  EXPECT_FALSE(budget.spent(34));
  EXPECT_TRUE(budget.spent(35));
  EXPECT_NEAR(budget.progress(17), 17.0 / 34.49, 1e-3);
  EXPECT_EQ(budget.progress(40), 1.0);
  budget.noteInliers(1.0);
  EXPECT_TRUE(budget.spent(1));
}

TEST(SampleBudget, KeepsItsLimits) {
  SampleBudget budget(100, 0.99);
  budget.noteInliers(1.0);
  EXPECT_FALSE(budget.spent(0));
  EXPECT_TRUE(budget.spent(1));
  for (const double few : {0.0, 1e-5, 0.05}) {
    budget.noteInliers(few);
    EXPECT_FALSE(budget.spent(99)) << few;
    EXPECT_TRUE(budget.spent(100)) << few;
    EXPECT_NEAR(budget.progress(50), 0.5, 1e-12) << few;
  }
}

}  // namespace test_minimal_sampling

namespace test_sample_consensus {

Consensus search(const SeenPoints& scene, const std::string& method, int seed = 1, int max_iterations = 500) {
  SampleConsensusOptions options;
  options.consensus = valueOf<ConsensusMethod>(method);
  options.seed = seed;
  options.max_iterations = max_iterations;
  return findConsensus(PoseProblem(scene.camera, scene.correspondences, options.inlier_threshold), options, {});
}

std::vector<int> inliersOf(const Consensus& consensus, const SeenPoints& scene) {
  return PoseProblem(scene.camera, scene.correspondences, SampleConsensusOptions().inlier_threshold)
      .inliers(consensus.T_current_reference);
}

class EveryMethod : public testing::TestWithParam<const char*> {};

TEST_P(EveryMethod, RecoversTheMotionAmongSixtyPercentOutliers) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const SeenPoints scene = seenPoints(seed, 200, 0.2, 0.6);
    ASSERT_EQ(scene.inliers.size(), 80u);
    const Consensus consensus = search(scene, GetParam(), static_cast<int>(seed));
    ASSERT_TRUE(consensus.found) << "seed " << seed;
    const Eigen::Isometry3d error = trueMotion().inverse() * consensus.T_current_reference;
    // A minimal sample is as good as its three points: 0.2 px at 400 px focal length are 0.5 mrad.
    EXPECT_LT(error.translation().norm(), 0.12) << "seed " << seed;
    EXPECT_LT(logSO3(error.linear()).norm(), 0.01) << "seed " << seed;
    const std::vector<int> inliers = inliersOf(consensus, scene);
    std::vector<int> right;
    std::set_intersection(inliers.begin(), inliers.end(), scene.inliers.begin(), scene.inliers.end(),
                          std::back_inserter(right));
    EXPECT_GE(right.size(), 60u) << "seed " << seed;
    EXPECT_LE(inliers.size() - right.size(), 3u) << "seed " << seed;
  }
}

TEST_P(EveryMethod, EqualSeedsGiveEqualResultsAndOthersDiffer) {
  const SeenPoints scene = seenPoints(2, 200, 0.5, 0.5);
  const Consensus first = search(scene, GetParam(), 7), again = search(scene, GetParam(), 7);
  EXPECT_TRUE(first.T_current_reference.matrix() == again.T_current_reference.matrix());
  EXPECT_EQ(first.iterations, again.iterations);
  int different = 0;
  for (int seed = 8; seed < 12; ++seed)
    different += !(search(scene, GetParam(), seed).T_current_reference.matrix() == first.T_current_reference.matrix());
  EXPECT_GT(different, 0);
}

TEST_P(EveryMethod, KeepsToTheBoundsOnSamples) {
  const SeenPoints hopeless = seenPoints(3, 200, 0.0, 1.0);
  EXPECT_EQ(search(hopeless, GetParam(), 1, 120).iterations, 120);
  const SeenPoints clean = seenPoints(3, 200, 0.05, 0.0);
  EXPECT_LE(search(clean, GetParam()).iterations, GeneticConsensusOptions::kPopulation) << "the first generation";
}

TEST_P(EveryMethod, FindsNothingInTooFewCorrespondences) {
  SeenPoints scene = seenPoints(1, 3, 0.0, 0.0);
  EXPECT_FALSE(search(scene, GetParam()).found);
  scene.correspondences.clear();
  const Consensus none = search(scene, GetParam());
  EXPECT_FALSE(none.found);
}

INSTANTIATE_TEST_SUITE_P(ByName, EveryMethod, testing::Values("ransac", "msac", "lo_ransac", "gasac", "adaptive_gasac"),
                         [](const auto& parameter) { return std::string(parameter.param); });

/// A minimal sample carries the noise of its three points; optimised over all of its inliers a pose gathers more of
/// them.
TEST(SampleConsensus, LocalOptimisationFindsMoreInliers) {
  std::size_t plain = 0, optimised = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const SeenPoints scene = seenPoints(seed, 200, 0.7, 0.4);
    plain += inliersOf(search(scene, "ransac", static_cast<int>(seed)), scene).size();
    optimised += inliersOf(search(scene, "lo_ransac", static_cast<int>(seed)), scene).size();
  }
  EXPECT_GT(optimised, plain);
}

// What a local optimisation has gained is not given up for a later sample that is better than the one before it.
TEST(SampleConsensus, MoreSamplesNeverGiveAWorsePose) {
  for (const char* method : {"msac", "lo_ransac"})
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const SeenPoints scene = seenPoints(seed, 100, 0.7, 0.4);
      SampleConsensusOptions options;
      options.consensus = valueOf<ConsensusMethod>(method);
      const PoseProblem problem(scene.camera, scene.correspondences, options.inlier_threshold);
      double best = std::numeric_limits<double>::max();
      for (int samples = 1; samples <= 40; ++samples) {
        options.max_iterations = samples;
        const Consensus consensus = findConsensus(problem, options, {});
        if (!consensus.found) continue;
        const double cost = problem.truncatedCost(consensus.T_current_reference);
        EXPECT_LE(cost, best) << method << ", seed " << seed << ", " << samples << " samples";
        best = cost;
      }
    }
}

TEST(SampleConsensus, LocalOptimisationUsesTheKernelOfTheRefinement) {
  const SeenPoints scene = seenPoints(1, 200, 0.7, 0.4);
  SampleConsensusOptions options;
  options.consensus = ConsensusMethod::kLoRansac;
  const PoseProblem problem(scene.camera, scene.correspondences, options.inlier_threshold);
  const auto poseWith = [&](double scale) {
    MotionRefinementOptions refinement;
    refinement.kernel_scale = scale;
    return findConsensus(problem, options, refinement).T_current_reference.matrix();
  };
  const Eigen::Matrix4d cauchy = poseWith(1.0);
  EXPECT_EQ(cauchy, poseWith(1.0));
  EXPECT_NE(cauchy, poseWith(0.2));
}

}  // namespace test_sample_consensus

}  // namespace sdvo
