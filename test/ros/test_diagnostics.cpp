#include <gtest/gtest.h>

#include <cmath>

#include "../../src/ros/diagnostics.hpp"
#include "../said.hpp"

namespace sdvo::test_diagnostics {

TEST(DoubtOfLatency, StampsOfTheFutureAndThePast) {
  for (const double latency : {-0.05, 0.0, 0.3}) EXPECT_EQ(doubtOfLatency(latency, 0.5), "") << latency;
  EXPECT_TRUE(contains(doubtOfLatency(0.6, 0.5), "too slow"));
  for (const double latency : {-0.3, -5.0})
    EXPECT_TRUE(contains(doubtOfLatency(latency, 0.5), "stamped in the future")) << latency;
  EXPECT_TRUE(contains(doubtOfLatency(std::nan(""), 0.5), "--clock"));
}

TEST(DoubtOfLatency, AClockSinceBoot) {
  EXPECT_TRUE(contains(doubtOfLatency(1795739520.0, 0.5), "another clock than this machine"));
  EXPECT_FALSE(contains(doubtOfLatency(1795739520.0, 0.5), "too slow"));
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

}  // namespace sdvo::test_diagnostics
