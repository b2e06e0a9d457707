#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../../src/ros/diagnostics/diagnostic_tasks.hpp"
#include "../said.hpp"
#include "message_samples.hpp"

namespace sdvo::test_work_load {

using Level = WallUpdater::Level;

WallUpdater::Status diagnose(WorkLoad& load) {
  WallUpdater::Status status;
  WallUpdater::print(load.judge(status), status);
  return status;
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
  EXPECT_EQ(diagnose(load).level, Level::WARN);
  EXPECT_EQ(diagnose(load).level, Level::OK) << "of the time since";
  load.noteDropped(5);
  {
    const WorkLoad::Item item(load);
    work();
  }
  EXPECT_TRUE(contains(diagnose(load).message, "too slow: 2 pairs dropped"));
}

TEST(WorkLoad, PairsDroppedWhileItWaitedAreNot) {
  WorkLoad load(1.0);
  {
    const WorkLoad::Item item(load);
    load.noteWait("the guess of the motion", 0.1);
    load.noteWait("the transform base <- camera", 2.0);
  }
  load.noteDropped(40);
  const WallUpdater::Status status = diagnose(load);
  EXPECT_EQ(status.level, Level::WARN);
  expectWords(status.message, {"40 pairs dropped", "waited for the transform base <- camera"});
  EXPECT_FALSE(contains(status.message, "too slow")) << status.message;
}

TEST(WorkLoad, PairsDroppedWhileItMostlyRestedCameInBursts) {
  WorkLoad load(1.0);
  { const WorkLoad::Item item(load); }
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  load.noteDropped(9);
  const WallUpdater::Status status = diagnose(load);
  EXPECT_EQ(status.level, Level::WARN);
  expectWords(status.message, {"9 pairs dropped", "come in bursts, set queue_size"});
}

}  // namespace sdvo::test_work_load
