#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../experiments/bootstrap.hpp"

namespace sdvo {
namespace test_bootstrap {

TEST(Bootstrap, CoversTheTrueMeanAboutAsOftenAsItSays) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(10.0, 2.0);
  int covered = 0;
  double width = 0.0;
  constexpr int kSamples = 200, kUnits = 25;
  for (int sample = 0; sample < kSamples; ++sample) {
    std::vector<double> values;
    for (int i = 0; i < kUnits; ++i) values.push_back(normal(random));
    const Interval interval = bootstrapMean(values);
    covered += interval.low <= 10.0 && 10.0 <= interval.high;
    width += (interval.high - interval.low) / kSamples;
  }
  EXPECT_GT(covered, 0.88 * kSamples);
  EXPECT_LT(covered, 0.99 * kSamples);
  EXPECT_NEAR(width, 2.0 * 1.96 * 2.0 / std::sqrt(kUnits), 0.15);
}

TEST(Bootstrap, UnitsAreDrawnWhole) {
  // A ratio of sums is taken within each draw: with units that all have the same ratio it does not vary.
  const std::vector<double> above = {2.0, 40.0, 6.0}, below = {1.0, 20.0, 3.0};
  const Interval interval = bootstrap(3, [&](const std::vector<int>& drawn) {
    double a = 0.0, b = 0.0;
    for (const int i : drawn) a += above[static_cast<std::size_t>(i)], b += below[static_cast<std::size_t>(i)];
    return a / b;
  });
  EXPECT_DOUBLE_EQ(interval.low, 2.0);
  EXPECT_DOUBLE_EQ(interval.high, 2.0);
}

TEST(Bootstrap, OneUnitTellsNothingOfItsSpread) {
  EXPECT_TRUE(std::isnan(bootstrapMean({5.0}).low));
  EXPECT_TRUE(std::isnan(bootstrapMean({}).high));
}

}  // namespace test_bootstrap
}  // namespace sdvo
