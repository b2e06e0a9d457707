#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../../src/ros/diagnostics.hpp"

namespace sdvo {
namespace test_diagnostics {

TEST(DoubtOfLatency, StampsOfTheFutureAndThePast) {
  for (const double latency : {-0.05, 0.0, 0.3}) EXPECT_EQ(doubtOfLatency(latency, 0.5), "") << latency;
  EXPECT_NE(doubtOfLatency(0.6, 0.5).find("too slow"), std::string::npos);
  for (const double latency : {-0.3, -5.0})
    EXPECT_NE(doubtOfLatency(latency, 0.5).find("stamped in the future"), std::string::npos) << latency;
  EXPECT_NE(doubtOfLatency(std::nan(""), 0.5).find("--clock"), std::string::npos);
}

}  // namespace test_diagnostics
}  // namespace sdvo
