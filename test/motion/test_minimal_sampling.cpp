#include <gtest/gtest.h>

#include <set>

#include "stereo_descriptor_vo/motion/minimal_sampling.hpp"

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
}  // namespace sdvo
