#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <utility>

#include "diagnostic_tasks.hpp"

namespace sdvo {

/// Input that a node did not use, by cause since its start: the one place that counts, for messages and /diagnostics.
/// Counting is for any thread.
class UnusedInput {
 public:
  enum Cause { kUnpaired, kPushedOut, kLate, kRefused, kNoGuess, kImu };
  static constexpr int kCauses = 6;

  /// `what`: of the input, in the plural. `max_share` of it that may be missing before the task warns, but of causes
  /// that are `explained` elsewhere.
  UnusedInput(std::string what, double max_share, std::set<int> explained = {})
      : what_(std::move(what)), max_share_(max_share), explained_(std::move(explained)) {}

  void noteUsed() { ++used_; }
  void add(Cause cause) { ++counts_[cause]; }
  /// What was given up is used after all.
  void takeBack(Cause cause) { --counts_[cause]; }

  std::uint64_t count(Cause cause) const { return counts_[cause]; }
  /// Of all causes but missing guesses and the IMU's, without which the rest is used.
  std::uint64_t sum() const { return count(kUnpaired) + count(kPushedOut) + count(kLate) + count(kRefused); }

  /// Adds the counts to a task of /diagnostics, and a warning of causes that took more than their share in the last
  /// seconds. Once a second, by one thread.
  void diagnose(WallUpdater::Status& status);

 private:
  using Counts = std::array<std::uint64_t, kCauses + 1>;  ///< the last one: used

  const std::string what_;
  const double max_share_;
  const std::set<int> explained_;
  std::atomic<std::uint64_t> used_{0};
  std::array<std::atomic<std::uint64_t>, kCauses> counts_{};
  std::deque<Counts> history_;  ///< of the last calls
};

}  // namespace sdvo
