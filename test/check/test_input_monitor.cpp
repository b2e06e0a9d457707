#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "../../src/check/input_monitor.hpp"
#include "../said.hpp"

namespace sdvo::test_input_monitor {

Finding judge(InputMonitor& monitor) {
  Values values;
  return monitor.judge(values).front();
}

void sleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

TEST(InputMonitor, WarnsAtTheStartUntilItShouldHaveCome) {
  InputMonitor monitor("pairs", "/left", 0.2, {});
  EXPECT_EQ(judge(monitor).verdict, Verdict::kWarn);
  EXPECT_TRUE(contains(judge(monitor).text(), "no pairs yet on /left"));
  sleep(0.25);
  EXPECT_EQ(judge(monitor).verdict, Verdict::kFail);
  monitor.note(1);
  EXPECT_EQ(judge(monitor).verdict, Verdict::kOk);
  sleep(0.25);
  EXPECT_EQ(judge(monitor).verdict, Verdict::kFail);
  EXPECT_TRUE(contains(judge(monitor).text(), "no pairs for"));
}

TEST(InputMonitor, NamesTheTopicsThatInputComesFromNow) {
  InputMonitor monitor("pairs", "/left", 0.05, {});
  monitor.noteTopics("/infra1");
  Values values;
  EXPECT_TRUE(contains(monitor.judge(values).front().what, "no pairs yet on /infra1"));
  EXPECT_EQ(values.all().back().second, "/infra1");
}

TEST(InputMonitor, SilenceIsNoFaultWhileNobodyWantsInput) {
  InputMonitor monitor("pairs", "/left", 0.05, {});
  monitor.note(1);
  monitor.noteIdle("paused");
  sleep(0.1);
  EXPECT_EQ(judge(monitor).verdict, Verdict::kOk);
  EXPECT_EQ(judge(monitor).text(), "paused");
  monitor.noteIdle("");
  EXPECT_EQ(judge(monitor).verdict, Verdict::kWarn) << "as at the start";
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
  EXPECT_EQ(judge(is_slow).verdict, Verdict::kWarn);
  EXPECT_TRUE(contains(judge(is_slow).remedy, "driver or network"));
  EXPECT_EQ(judge(is_fast).verdict, Verdict::kWarn);
  EXPECT_FALSE(contains(judge(is_fast).remedy, "driver or network"));
  EXPECT_EQ(judge(is_fine).verdict, Verdict::kOk);
}

TEST(InputMonitor, TheRateIsThatOfTheStamps) {
  InputMonitor slowed("pairs", "/left", 5.0, {}), burst("pairs", "/left", 5.0, {});
  for (int i = 0; i < 4; ++i) {  // 20 Hz, of a simulation at a third of that, and all at once
    slowed.note(i * 50'000'000);
    sleep(0.15);
  }
  for (int i = 0; i < 10; ++i) burst.note(i * 50'000'000);
  for (InputMonitor* monitor : {&slowed, &burst}) EXPECT_EQ(judge(*monitor).text(), "20.00 pairs a second");
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

}  // namespace sdvo::test_input_monitor
