#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "../../check/finding.hpp"
#include "../../config/interface_options.hpp"

namespace sdvo {

using Findings = std::vector<Finding>;

/// /diagnostics once a second of wall time: simulated time stands still at the end of a bag, which diagnostics must
/// report. Declare it after the members that its tasks use.
class WallUpdater {
 public:
  using Status = diagnostic_updater::DiagnosticStatusWrapper;
  using Level = diagnostic_msgs::DiagnosticStatus;

  WallUpdater(ros::NodeHandle& nh, ros::NodeHandle& private_nh, const std::string& name)
      : updater_(nh, private_nh, name) {
    updater_.setHardwareID("none");
    timer_ =
        nh.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.force_update(); });
  }

  /// `judge` adds its values to the status that it is given, and returns what it finds.
  template <class Owner>
  void add(const std::string& task, Owner* owner, Findings (Owner::*judge)(Status& values)) {
    updater_.add(task, [owner, judge](Status& status) { print((owner->*judge)(status), status); });
  }

  /// The first finding, and the faults among the others.
  static void print(const Findings& findings, Status& status);

 private:
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
};

/// Silence of an input in wall time, and its rate by stamps, which neither simulated time nor a network changes. For
/// any thread.
class InputMonitor {
 public:
  /// `what`: of the input, in the plural. `topics`: where it comes from. `max_silence`: s.
  InputMonitor(std::string what, std::string topics, double max_silence, const RateOptions& rates);

  /// `stamp`: ns.
  void note(std::int64_t stamp);
  /// From now on the input comes from other topics.
  void noteTopics(const std::string& topics);
  /// From now on silence is no fault, because of `why`, such as "paused"; if that is empty, it is a fault again.
  /// Earlier arrivals are forgotten.
  void noteIdle(const std::string& why);

  /// Nothing while input comes.
  std::optional<Finding> silence() const;

  /// The task "input rate".
  Findings judge(WallUpdater::Status& values);

 private:
  using Clock = std::chrono::steady_clock;

  static double secondsSince(Clock::time_point time);
  std::optional<double> rate() const;

  const std::string what_;
  const double max_silence_;
  const RateOptions rates_;
  mutable std::mutex mutex_;
  std::string topics_, idle_;
  Clock::time_point begin_ = Clock::now();
  struct Arrival {
    Clock::time_point time;
    std::int64_t stamp;
  };
  std::deque<Arrival> arrivals_;  ///< of the last seconds, at least the newest ones
};

/// Counts of input that a node did not use, by cause, since its start. Messages and /diagnostics have them from here.
/// Counting is for any thread.
class UnusedInput {
 public:
  enum Cause { kUnpaired, kPushedOut, kLate, kRefused, kNoGuess, kImu };
  static constexpr int kCauses = 6;

  /// `what`: name of the input, in the plural. Beyond `max_share` of unused input the task warns, except of causes that
  /// are `explained` elsewhere.
  UnusedInput(std::string what, double max_share, std::set<int> explained = {})
      : what_(std::move(what)), max_share_(max_share), explained_(std::move(explained)) {}

  void noteUsed() { ++used_; }
  void add(Cause cause, std::uint64_t count = 1) { counts_[cause] += count; }
  /// For input that is used after it was counted.
  void takeBack(Cause cause) { --counts_[cause]; }

  std::uint64_t count(Cause cause) const { return counts_[cause]; }
  /// Sum over the causes that lose a pair. Pairs without a guess or IMU are used.
  std::uint64_t sum() const { return count(kUnpaired) + count(kPushedOut) + count(kLate) + count(kRefused); }

  /// Adds the counts to the values of a task of /diagnostics. Returns `first` and a warning for each cause beyond
  /// max_share in the last seconds. Call once a second, from one thread.
  Findings judge(Finding first, WallUpdater::Status& values);

 private:
  using Counts = std::array<std::uint64_t, kCauses + 1>;  ///< the last one: used

  const std::string what_;
  const double max_share_;
  const std::set<int> explained_;
  std::atomic<std::uint64_t> used_{0};
  std::array<std::atomic<std::uint64_t>, kCauses> counts_{};
  std::deque<Counts> history_;  ///< of the last calls
};

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
  void noteWait(const std::string& what, double time) {
    const std::lock_guard<std::mutex> lock(mutex_);
    wait_ += time;
    if (time > longest_wait_) awaited_ = what;
    longest_wait_ = std::max(longest_wait_, time);
  }

  /// Items that were dropped since the start because the thread was busy.
  void noteDropped(std::uint64_t dropped) {
    const std::lock_guard<std::mutex> lock(mutex_);
    dropped_ = dropped;
  }

  /// The task "load", over the time since the last call.
  Findings judge(WallUpdater::Status& values);

 private:
  /// CPU time of this thread, s.
  static double threadTime() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  void note(double time, double busy) {
    const std::lock_guard<std::mutex> lock(mutex_);
    time_ += time;
    busy_ += busy;
    ++items_;
  }

  const double max_load_;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::uint64_t dropped_ = 0, reported_ = 0;
  double time_ = 0.0, busy_ = 0.0, wait_ = 0.0, longest_wait_ = 0.0;  ///< s: CPU, wall
  std::string awaited_;                                               ///< the longest
  int items_ = 0;
};

}  // namespace sdvo
