#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../src/rig/row_delay.hpp"

namespace sdvo::test_row_delay {

constexpr double kDelay = 0.003;  // s

/// A rig whose rows differ by its rectification, by another height of the right camera, and by noise.
class Rig {
 public:
  Rig(double delay, unsigned seed) : delay_(delay), random_(seed) {}

  /// 200 points of a view that goes down by `turning` px/s, and by `along` px/s for each px of disparity.
  std::vector<RowDelay::Sample> pair(double turning, double along) {
    std::vector<RowDelay::Sample> rows;
    for (int i = 0; i < 200; ++i) {
      const double u = 640.0 * uniform(), v = 480.0 * uniform(), disparity = 5.0 + 20.0 * uniform() * v / 480.0;
      const double velocity = turning + along * disparity * (v - 240.0) / 240.0;
      const double rectification = 0.4 * (u - 320.0) / 320.0 - 0.3 * (v - 240.0) / 240.0 + 0.01 * disparity;
      rows.push_back({RowDelay::partOf(u, v, 640, 480), rectification + delay_ * velocity + 0.15 * normal_(random_),
                      velocity, turning, disparity});
    }
    rows[7].dv = 30.0;  // a wrong match
    return rows;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>()(random_); }

  double delay_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

RowDelay ofNods(double delay, double nod, double along, unsigned seed = 1) {
  Rig rig(delay, seed);
  RowDelay rows(0.995, 2.0);
  for (int k = 0; k < 100; ++k) rows.add(rig.pair(nod * std::sin(0.5 * k), along));
  return rows;
}

TEST(RowDelay, FindsItAmongErrorsOfTheRectification) {
  for (const double delay : {-kDelay, kDelay}) {
    const auto found = ofNods(delay, 40.0, 5.0).estimate();
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value, delay, 2e-4);
    EXPECT_GT(std::abs(found->significantValue()), 0.9 * kDelay);
  }
}

TEST(RowDelay, ProvesNoneOnARigInStep) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const auto found = ofNods(0.0, 40.0, 5.0, seed).estimate();
    ASSERT_TRUE(found);
    EXPECT_EQ(found->significantValue(), 0.0)
        << 1e3 * found->value << " +- " << 1e3 * found->sigma << " ms, seed " << seed;
  }
}

TEST(RowDelay, IsUnknownWhereTheViewHardlyTurns) {
  EXPECT_FALSE(ofNods(kDelay, 1.0, 10.0).estimate())
      << "rows move as the depth has it, and so does a bad rectification";
  EXPECT_FALSE(RowDelay(0.995, 2.0).estimate());
}

TEST(RowDelay, SignificantIsWhatChanceDoesNotExplain) {
  // A normal distribution exceeds 3.89 standard deviations once in 10,000 times.
  for (const double sign : {-1.0, 1.0}) {
    EXPECT_NEAR((RowDelay::Estimate{5.0 * sign, 1.0}.significantValue()), sign * std::sqrt(5.0 * 5.0 - 3.89 * 3.89),
                0.01);
    EXPECT_EQ((RowDelay::Estimate{3.0 * sign, 1.0}.significantValue()), 0.0);
  }
}

TEST(RowDelay, PartsOfTheImageAreRowByRow) {
  EXPECT_EQ(RowDelay::partOf(-1.0, -1.0, 600, 400), 0);
  EXPECT_EQ(RowDelay::partOf(599.0, 99.0, 600, 400), RowDelay::kColumns - 1);
  EXPECT_EQ(RowDelay::partOf(700.0, 500.0, 600, 400), RowDelay::kColumns * RowDelay::kRows - 1);
}

}  // namespace sdvo::test_row_delay
