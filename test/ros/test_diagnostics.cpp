#include <gtest/gtest.h>

#include "../../src/ros/diagnostics/diagnostics.hpp"

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

}  // namespace sdvo::test_diagnostics
