#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <vector>

#include "../../src/common/worker.hpp"

namespace sdvo::test_worker {

using namespace std::chrono_literals;

/// As a thread's local variable: notes the thread's end.
struct EndOfThread {
  std::atomic<bool>& has_ended;
  ~EndOfThread() { has_ended = true; }
};

TEST(Worker, HandlesEveryItemInOrder) {
  constexpr int kItems = 500;
  std::vector<int> handled;
  std::promise<void> done;
  Worker<int> worker(kItems, [&](const int& item) {
    handled.push_back(item);
    if (item == kItems - 1) done.set_value();
  });
  for (int i = 0; i < kItems; ++i) EXPECT_TRUE(worker.push(i));
  ASSERT_EQ(done.get_future().wait_for(10s), std::future_status::ready);
  ASSERT_EQ(handled.size(), static_cast<std::size_t>(kItems));
  for (int i = 0; i < kItems; ++i) EXPECT_EQ(handled[static_cast<std::size_t>(i)], i);
}

TEST(Worker, DropsTheOldestWhenFullAndSaysSo) {
  std::vector<int> handled;
  std::promise<void> started, released, done;
  std::shared_future<void> release = released.get_future().share();
  Worker<int> worker(3, [&](const int& item) {
    if (item == 0) {
      started.set_value();
      release.wait();
    }
    handled.push_back(item);
    if (item == 5) done.set_value();
  });
  worker.push(0);
  ASSERT_EQ(started.get_future().wait_for(10s), std::future_status::ready);
  // The first item occupies the thread, not the queue: of the next five the newest three stay.
  for (int item = 1; item <= 5; ++item) {
    EXPECT_EQ(worker.isFull(), item > 3);
    EXPECT_EQ(worker.push(item), item <= 3);
  }
  released.set_value();
  ASSERT_EQ(done.get_future().wait_for(10s), std::future_status::ready);
  EXPECT_EQ(handled, (std::vector<int>{0, 3, 4, 5}));
}

TEST(Worker, NeverLetsThePusherWait) {
  std::promise<void> released;
  std::shared_future<void> release = released.get_future().share();
  Worker<int> worker(1, [&](const int&) { release.wait(); });
  const auto pushed = std::async(std::launch::async, [&] {
    for (int i = 0; i < 100; ++i) worker.push(i);
  });
  EXPECT_EQ(pushed.wait_for(10s), std::future_status::ready);
  released.set_value();
}

TEST(Worker, JoinsTheItemInWorkAndLeavesTheRest) {
  std::atomic<int> finished{0};
  std::atomic<bool> has_ended{false};
  std::promise<void> started;
  {
    Worker<int> worker(10, [&](const int& item) {
      const thread_local EndOfThread end{has_ended};
      if (item == 0) started.set_value();
      std::this_thread::sleep_for(100ms);  // the Worker is destroyed meanwhile
      ++finished;
    });
    worker.push(0);
    started.get_future().wait();
    worker.push(1);
  }
  EXPECT_TRUE(has_ended) << "the thread outlived its Worker";
  EXPECT_EQ(finished, 1);
}

TEST(Worker, TheHandlerCanAskItsWorkerToTheVeryEnd) {
  std::promise<void> started;
  std::unique_ptr<Worker<int>> worker;
  std::atomic<bool> asked{false};
  worker = std::make_unique<Worker<int>>(1, [&](const int&) {
    started.set_value();
    std::this_thread::sleep_for(50ms);  // stop() is called meanwhile
    EXPECT_FALSE(worker->isFull());
    asked = true;
  });
  worker->push(0);
  started.get_future().wait();
  worker->stop();
  EXPECT_TRUE(asked);
  worker->push(1);  // goes nowhere
  worker->stop();
}

TEST(Worker, EndsWithoutEverHavingHadAnItem) {
  for (int i = 0; i < 50; ++i) Worker<int>(1, [](const int&) {});
}

TEST(Requests, HoldForWhatArrivesLaterAndOnce) {
  Requests<char> requests;
  const int queued = requests.posted();
  requests.post('a');
  const int later = requests.posted();
  EXPECT_FALSE(requests.take(queued)) << "it waited in the queue when the request came";
  EXPECT_EQ(requests.take(later), 'a');
  EXPECT_FALSE(requests.take(later));
}

TEST(Requests, TheNewestWins) {
  Requests<char> requests;
  requests.post('a');
  const int between = requests.posted();
  requests.post('b');
  EXPECT_FALSE(requests.take(between)) << "another one is to come before it matters";
  EXPECT_EQ(requests.take(requests.posted()), 'b');
}

}  // namespace sdvo::test_worker
