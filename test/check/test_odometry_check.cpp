#include <gtest/gtest.h>

#include <cmath>

#include "../../src/check/odometry_check.hpp"
#include "../said.hpp"

namespace sdvo::test_odometry_check {

constexpr double kUnknown = NAN;

TEST(ShutterCheck, NamesWhatIsProvedAndNothingElse) {
  EXPECT_EQ(doubtOfShutters({kUnknown, kUnknown}), "");
  EXPECT_EQ(doubtOfShutters({0.0005, 0.0001}), "") << "less than matters";
  EXPECT_EQ(doubtOfShutters({0.02, 0.02}), "") << "within chance";
  EXPECT_TRUE(contains(doubtOfShutters({-0.0062, 0.0001}), "right images are taken 6.2 +- 0.1 ms before"));
  EXPECT_TRUE(contains(doubtOfShutters({0.0062, 0.0001}), "6.2 +- 0.1 ms after left ones"));
}

}  // namespace sdvo::test_odometry_check
