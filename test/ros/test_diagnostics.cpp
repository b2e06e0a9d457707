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

TEST(DoubtOfLatency, AClockSinceBoot) {
  EXPECT_NE(doubtOfLatency(1795739520.0, 0.5).find("another clock than this machine"), std::string::npos);
  EXPECT_EQ(doubtOfLatency(1795739520.0, 0.5).find("too slow"), std::string::npos);
}

TEST(ExposureTurns, AreNamedAndNoLampIs) {
  ExposureTurns turns, mild, lamp;
  for (int i = 0; i < 20; ++i) {
    turns.add(i % 2 ? 6.0 : 150.0);
    mild.add(i % 2 ? 20.0 : 140.0);
    lamp.add(i % 6 < 3 ? 6.0 : 150.0);
    EXPECT_FALSE(lamp.takeTurns());
  }
  EXPECT_TRUE(turns.takeTurns());
  EXPECT_FALSE(mild.takeTurns());
}

}  // namespace test_diagnostics
}  // namespace sdvo
