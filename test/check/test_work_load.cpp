#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../../src/check/work_load.hpp"
#include "../said.hpp"

namespace sdvo::test_work_load {

Finding judge(WorkLoad& load) {
  Values values;
  return load.judge(values).front();
}

void work() {
  volatile double sum = 0.0;
  for (int i = 0; i < 20000000; ++i) sum = sum + i;
}

TEST(WorkLoad, PairsDroppedWhileItWorkedAreOfASlowMachine) {
  WorkLoad load(1.0);
  {
    const WorkLoad::Item item(load);
    work();
  }
  load.noteWait("the transform base <- camera", 0.0);  // it was there
  load.noteDropped(3);
  EXPECT_EQ(judge(load).verdict, Verdict::kWarn);
  EXPECT_EQ(judge(load).verdict, Verdict::kOk) << "of the time since";
  load.noteDropped(5);
  {
    const WorkLoad::Item item(load);
    work();
  }
  EXPECT_TRUE(contains(judge(load).text(), "too slow: 2 pairs dropped"));
}

TEST(WorkLoad, PairsDroppedWhileItWaitedAreNot) {
  WorkLoad load(1.0);
  {
    const WorkLoad::Item item(load);
    load.noteWait("the guess of the motion", 0.1);
    load.noteWait("the transform base <- camera", 2.0);
  }
  load.noteDropped(40);
  const Finding found = judge(load);
  EXPECT_EQ(found.verdict, Verdict::kWarn);
  expectWords(found.text(), {"40 pairs dropped", "waited for the transform base <- camera"});
  EXPECT_FALSE(contains(found.text(), "too slow")) << found.text();
}

TEST(WorkLoad, PairsDroppedWhileItMostlyRestedCameInBursts) {
  WorkLoad load(1.0);
  { const WorkLoad::Item item(load); }
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  load.noteDropped(9);
  const Finding found = judge(load);
  EXPECT_EQ(found.verdict, Verdict::kWarn);
  expectWords(found.text(), {"9 pairs dropped", "come in bursts, set queue_size"});
}

}  // namespace sdvo::test_work_load
