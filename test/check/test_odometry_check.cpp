#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../../src/check/odometry_check.hpp"

namespace sdvo {
namespace test_odometry_check {

constexpr double kUnknown = NAN;

std::string doubt(double right, double right_sigma, double readout, double readout_sigma) {
  return doubtOfShutters({right, right_sigma}, {readout, readout_sigma});
}

TEST(ShutterCheck, NamesWhatIsProvedAndNothingElse) {
  EXPECT_EQ(doubt(kUnknown, kUnknown, kUnknown, kUnknown), "");
  EXPECT_EQ(doubt(0.0005, 0.0001, 0.0, 0.0001), "") << "less than matters";
  EXPECT_EQ(doubt(0.02, 0.02, 0.025, 0.025), "") << "within chance";
  EXPECT_NE(doubt(-0.0062, 0.0001, kUnknown, kUnknown).find("right images are taken 6.2 +- 0.1 ms before"),
            std::string::npos);
  EXPECT_NE(doubt(0.0062, 0.0001, 0.0, 0.001).find("6.2 +- 0.1 ms after left ones"), std::string::npos);
  EXPECT_NE(doubt(0.0062, 0.0001, 0.025, 0.001).find("in 25 ms at least: the cameras need a global shutter"),
            std::string::npos);
}

}  // namespace test_odometry_check
}  // namespace sdvo
