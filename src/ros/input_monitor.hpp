#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "../config/interface_options.hpp"
#include "wall_updater.hpp"

namespace sdvo {

/// Whether input comes, and how often, for /diagnostics. By wall time; for any thread.
class InputMonitor {
 public:
  /// `what`: of the input, in the plural. `topics`: where it comes from. `max_silence`: s.
  InputMonitor(std::string what, std::string topics, double max_silence, const RateOptions& rates);

  void note();
  /// While nobody wants input, silence is no fault; `why`, such as "paused", is empty otherwise. Begins anew.
  void noteIdle(const std::string& why);

  struct Silence {
    std::uint8_t level;
    std::string text;
  };
  /// Nothing while input comes.
  std::optional<Silence> silence() const;

  /// The task "input rate".
  void diagnose(WallUpdater::Status& status);

 private:
  using Clock = std::chrono::steady_clock;

  static double secondsSince(Clock::time_point time);
  std::optional<double> rate() const;

  const std::string what_, topics_;
  const double max_silence_;
  const RateOptions rates_;
  mutable std::mutex mutex_;
  std::string idle_;
  Clock::time_point begin_ = Clock::now();
  std::deque<Clock::time_point> arrivals_;  ///< of the last seconds, and the newest one
};

}  // namespace sdvo
