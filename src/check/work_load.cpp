#include "work_load.hpp"

#include <algorithm>
#include <utility>

namespace sdvo {
namespace {

constexpr const char* kRelief = "set fewer detector/max_features, take smaller images, or set a max_rate";

}  // namespace

Finding checkLoad(double load, double most, const std::string& more) {
  return warnIf(load > most, text(0, 100.0 * load, " % of one processor's time") + more, kRelief);
}

void WorkLoad::noteWait(const std::string& what, double time) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wait_ += time;
  if (time > longest_wait_) awaited_ = what;
  longest_wait_ = std::max(longest_wait_, time);
}

void WorkLoad::note(double time, double busy) {
  const std::lock_guard<std::mutex> lock(mutex_);
  time_ += time;
  busy_ += busy;
  ++items_;
}

Findings WorkLoad::judge(Values& values) {
  constexpr double kOften = 0.5;  // ratio of wall time at work, below which drops are for bursts (chosen)
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const double period = std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  const double time = std::exchange(time_, 0.0), busy = std::exchange(busy_, 0.0), wait = std::exchange(wait_, 0.0);
  const double load = period > 0.0 ? time / period : 0.0;
  const int items = std::exchange(items_, 0);
  const std::uint64_t dropped = dropped_ - std::exchange(reported_, dropped_);
  longest_wait_ = 0.0;
  values.add("CPU time [ms a pair]", text(2, items > 0 ? 1e3 * time / items : 0.0));
  values.add("CPU time [share of one processor]", text(2, load));
  values.add("dropped since the start", dropped_);
  const std::string loss = text(0, dropped, " pairs dropped in ", period, " s");
  if (dropped > 0 && wait > time) return {{Verdict::kWarn, loss + ", while it waited for " + awaited_}};
  if (dropped > 0 && busy < kOften * period)
    return {{Verdict::kWarn, text(0, loss, " though it worked for ", 100.0 * busy / period,
                                  " % of the time: they come in bursts, set queue_size to a burst's pairs")}};
  if (dropped > 0) return {{Verdict::kWarn, "too slow: " + loss, kRelief}};
  return {checkLoad(load, max_load_)};
}

}  // namespace sdvo
