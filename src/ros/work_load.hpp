#pragma once

#include <time.h>

#include <chrono>
#include <cstdint>
#include <mutex>

#include "wall_updater.hpp"

namespace sdvo {

/// How much of a processor one worker's thread takes, and what it had to leave out, for /diagnostics. What OpenCV does
/// in threads of its own is not in it.
class WorkLoad {
 public:
  /// `max_load`: share of one processor's time.
  explicit WorkLoad(double max_load) : max_load_(max_load) {}

  /// CPU time of this thread from construction to destruction counts as that of one item.
  class Item {
   public:
    explicit Item(WorkLoad& load) : load_(load), begin_(threadTime()) {}
    Item(const Item&) = delete;
    Item& operator=(const Item&) = delete;
    ~Item() { load_.note(threadTime() - begin_); }

   private:
    WorkLoad& load_;
    const double begin_;
  };

  /// Of items that were left out because the thread was busy, since the start.
  void noteDropped(std::uint64_t dropped) {
    const std::lock_guard<std::mutex> lock(mutex_);
    dropped_ = dropped;
  }

  /// The task "load", of the time since it was asked last.
  void diagnose(WallUpdater::Status& status) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    const double period = std::chrono::duration<double>(now - last_).count();
    const double load = period > 0.0 ? time_ / period : 0.0;
    const std::uint64_t dropped = dropped_ - reported_;
    status.addf("CPU time [ms a pair]", "%.2f", items_ > 0 ? 1e3 * time_ / items_ : 0.0);
    status.addf("CPU time [share of one processor]", "%.2f", load);
    status.add("dropped since the start", dropped_);
    if (dropped > 0)
      status.summaryf(WallUpdater::Level::WARN,
                      "too slow: %d pairs dropped in %.0f s; set fewer detector/max_features or a max_rate",
                      static_cast<int>(dropped), period);
    else if (load > max_load_)
      status.summaryf(WallUpdater::Level::WARN, "%.0f %% of one processor's time", 100.0 * load);
    else
      status.summaryf(WallUpdater::Level::OK, "%.0f %% of one processor's time", 100.0 * load);
    last_ = now;
    reported_ = dropped_;
    time_ = 0.0;
    items_ = 0;
  }

 private:
  /// CPU time of this thread, s.
  static double threadTime() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  void note(double time) {
    const std::lock_guard<std::mutex> lock(mutex_);
    time_ += time;
    ++items_;
  }

  const double max_load_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::uint64_t dropped_ = 0, reported_ = 0;
  double time_ = 0.0;  ///< s
  int items_ = 0;
};

}  // namespace sdvo
