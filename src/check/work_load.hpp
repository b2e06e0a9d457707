#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

#include "../common/text.hpp"
#include "finding.hpp"

namespace sdvo {

/// Times of a pair, ms.
struct PairTimes {
  double median, late;  ///< until it is done; late: 95 % are earlier
  double cpu;           ///< mean of all threads

  std::string words() const {
    return text(1, median, " ms a pair (median), ", late, " ms (95 %), ", cpu, " ms of CPU time");
  }
};

/// `load`, `most`: share of one processor's time. `more`: other figures.
Finding checkLoad(double load, double most, const std::string& more = "");

/// CPU load of a worker's thread and the items that it dropped, for /diagnostics. Threads of OpenCV are not counted.
class WorkLoad {
 public:
  /// `max_load`: share of one processor's time.
  explicit WorkLoad(double max_load) : max_load_(max_load) {}

  /// CPU time of this thread from construction to destruction counts as that of one item.
  class Item {
   public:
    explicit Item(WorkLoad& load) : load_(load), begin_(threadTime()), wall_begin_(std::chrono::steady_clock::now()) {}
    Item(const Item&) = delete;
    Item& operator=(const Item&) = delete;
    ~Item() {
      const std::chrono::duration<double> busy = std::chrono::steady_clock::now() - wall_begin_;
      load_.note(threadTime() - begin_, busy.count());
    }

   private:
    WorkLoad& load_;
    const double begin_;
    const std::chrono::steady_clock::time_point wall_begin_;
  };

  /// Time (s) that the thread waited for `what` during an item.
  void noteWait(const std::string& what, double time);

  /// Items that were dropped since the start because the thread was busy.
  void noteDropped(std::uint64_t dropped) {
    const std::lock_guard<std::mutex> lock(mutex_);
    dropped_ = dropped;
  }

  /// The task "load", over the time since the last call.
  Findings judge(Values& values);

 private:
  /// CPU time of this thread, s.
  static double threadTime() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  void note(double time, double busy);

  const double max_load_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::uint64_t dropped_ = 0, reported_ = 0;
  double time_ = 0.0, busy_ = 0.0, wait_ = 0.0, longest_wait_ = 0.0;  ///< s: CPU, wall
  std::string awaited_;                                               ///< the longest
  int items_ = 0;
};

}  // namespace sdvo
