#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "../config/interface_options.hpp"
#include "finding.hpp"

namespace sdvo {

/// `rate`: Hz, of what `what` says.
Finding checkRate(const std::string& what, double rate, const RateOptions& usual);

/// `latency`: s from stamps until what they stamp is `done`; negative for stamps in the future, by `ahead` at most.
/// `most`: the largest one that is no fault.
Finding checkLatency(double latency, double most, const std::string& done = "pose", double ahead = 0.1);

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
  Findings judge(Values& values);

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

}  // namespace sdvo
