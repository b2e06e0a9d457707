#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <utility>

#include "finding.hpp"

namespace sdvo {

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
  Findings judge(Finding first, Values& values);

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
