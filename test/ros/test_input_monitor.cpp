#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../../src/ros/diagnostics/diagnostic_tasks.hpp"
#include "../said.hpp"
#include "message_samples.hpp"

namespace sdvo::test_input_monitor {

using Level = WallUpdater::Level;

struct Diagnosis {
  int level;
  std::string text;
};

Diagnosis diagnose(InputMonitor& monitor) {
  WallUpdater::Status status;
  WallUpdater::print(monitor.judge(status), status);
  return {status.level, status.message};
}

void sleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

TEST(InputMonitor, WarnsAtTheStartUntilItShouldHaveCome) {
  InputMonitor monitor("pairs", "/left", 0.2, {});
  EXPECT_EQ(diagnose(monitor).level, Level::WARN);
  EXPECT_TRUE(contains(diagnose(monitor).text, "no pairs yet on /left"));
  sleep(0.25);
  EXPECT_EQ(diagnose(monitor).level, Level::ERROR);
  monitor.note(1);
  EXPECT_EQ(diagnose(monitor).level, Level::OK);
  sleep(0.25);
  EXPECT_EQ(diagnose(monitor).level, Level::ERROR);
  EXPECT_TRUE(contains(diagnose(monitor).text, "no pairs for"));
}

TEST(InputMonitor, NamesTheTopicsThatInputComesFromNow) {
  InputMonitor monitor("pairs", "/left", 0.05, {});
  monitor.noteTopics("/infra1");
  WallUpdater::Status status;
  EXPECT_TRUE(contains(monitor.judge(status).front().what, "no pairs yet on /infra1"));
  EXPECT_EQ(status.values.back().value, "/infra1");
}

TEST(InputMonitor, SilenceIsNoFaultWhileNobodyWantsInput) {
  InputMonitor monitor("pairs", "/left", 0.05, {});
  monitor.note(1);
  monitor.noteIdle("paused");
  sleep(0.1);
  EXPECT_EQ(diagnose(monitor).level, Level::OK);
  EXPECT_EQ(diagnose(monitor).text, "paused");
  monitor.noteIdle("");
  EXPECT_EQ(diagnose(monitor).level, Level::WARN) << "as at the start";
}

TEST(InputMonitor, RatesOutOfTheRangeAreWarnedOf) {
  RateOptions slow, fast, fits;
  slow.min_rate = 1e5, slow.max_rate = 1e9;
  fast.min_rate = 0.0, fast.max_rate = 0.1;
  fits.min_rate = 0.0, fits.max_rate = 1e9;
  InputMonitor is_slow("pairs", "/left", 5.0, slow), is_fast("pairs", "/left", 5.0, fast),
      is_fine("pairs", "/left", 5.0, fits);
  for (InputMonitor* monitor : {&is_slow, &is_fast, &is_fine})
    for (int i = 0; i < 3; ++i) monitor->note(i * 50'000'000);
  EXPECT_EQ(diagnose(is_slow).level, Level::WARN);
  EXPECT_TRUE(contains(diagnose(is_slow).text, "only"));
  EXPECT_EQ(diagnose(is_fast).level, Level::WARN);
  EXPECT_TRUE(contains(diagnose(is_fast).text, "at most"));
  EXPECT_EQ(diagnose(is_fine).level, Level::OK);
}

TEST(InputMonitor, TheRateIsThatOfTheStamps) {
  InputMonitor slowed("pairs", "/left", 5.0, {}), burst("pairs", "/left", 5.0, {});
  for (int i = 0; i < 4; ++i) {  // 20 Hz, of a simulation at a third of that, and all at once
    slowed.note(i * 50'000'000);
    sleep(0.15);
  }
  for (int i = 0; i < 10; ++i) burst.note(i * 50'000'000);
  for (InputMonitor* monitor : {&slowed, &burst}) EXPECT_EQ(diagnose(*monitor).text, "20.00 pairs a second");
}

}  // namespace sdvo::test_input_monitor
