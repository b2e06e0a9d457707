#include <gtest/gtest.h>

#include <cmath>

#include "../../src/ros/diagnostics/diagnostics.hpp"
#include "../said.hpp"

namespace sdvo::test_diagnostics {

using Level = WallUpdater::Level;

TEST(WallUpdater, PrintsTheFirstFindingAndTheFaultsOfOthers) {
  const Finding fine{Verdict::kOk, "fine"}, open{Verdict::kOpen, "open"}, bad{Verdict::kWarn, "bad", "mend it"},
      worse{Verdict::kFail, "worse"};
  struct Case {
    Findings findings;
    int level;
    std::string message;
  };
  for (const auto& [findings, level, message] :
       {Case{{fine, open}, Level::OK, "fine"}, Case{{open, bad}, Level::WARN, "bad: mend it"},
        Case{{bad, fine, worse}, Level::ERROR, "bad: mend it; worse"},
        Case{{worse.asWarning()}, Level::WARN, "worse"}}) {
    WallUpdater::Status status;
    WallUpdater::print(findings, status);
    EXPECT_EQ(status.level, level) << message;
    EXPECT_EQ(status.message, message);
  }
}

TEST(CheckLatency, StampsOfTheFutureAndThePastAndSinceBoot) {
  for (const double latency : {-0.05, 0.0, 0.3}) EXPECT_EQ(checkLatency(latency, 0.5).verdict, Verdict::kOk) << latency;
  for (const auto& [latency, words] :
       {std::pair(0.6, "0.600 s from image to pose: is the machine too slow"), std::pair(-0.3, "in the future"),
        std::pair(-5.0, "in the future"), std::pair(std::nan(""), "--clock"),
        std::pair(1795739520.0, "another clock than this machine")}) {
    EXPECT_EQ(checkLatency(latency, 0.5).verdict, Verdict::kWarn) << latency;
    EXPECT_TRUE(contains(checkLatency(latency, 0.5).text(), words)) << latency;
  }
  EXPECT_FALSE(contains(checkLatency(1795739520.0, 0.5).text(), "too slow"));
}

}  // namespace sdvo::test_diagnostics
