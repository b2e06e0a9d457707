#include "diagnostic_tasks.hpp"

#include <utility>

#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr double kWindow = 5.0;     // s, of the rate
constexpr std::size_t kFewest = 3;  // arrivals that make one

}  // namespace

InputMonitor::InputMonitor(std::string what, std::string topics, double max_silence, const RateOptions& rates)
    : what_(std::move(what)), max_silence_(max_silence), rates_(rates), topics_(std::move(topics)) {}

double InputMonitor::secondsSince(Clock::time_point time) {
  return std::chrono::duration<double>(Clock::now() - time).count();
}

void InputMonitor::note(std::int64_t stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  arrivals_.push_back({Clock::now(), stamp});
  while (arrivals_.size() > kFewest && secondsSince(arrivals_.front().time) > kWindow) arrivals_.pop_front();
}

void InputMonitor::noteTopics(const std::string& topics) {
  const std::lock_guard<std::mutex> lock(mutex_);
  topics_ = topics;
}

void InputMonitor::noteIdle(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  idle_ = why;
  begin_ = Clock::now();
  arrivals_.clear();
}

std::optional<InputMonitor::Silence> InputMonitor::silence() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!idle_.empty()) return Silence{WallUpdater::Level::OK, idle_};
  const double silence = secondsSince(arrivals_.empty() ? begin_ : arrivals_.back().time);
  const std::string age = text(0, silence, " s");
  if (arrivals_.empty() && silence <= max_silence_)
    return Silence{WallUpdater::Level::WARN, "no " + what_ + " yet on " + topics_};
  if (arrivals_.empty())
    return Silence{WallUpdater::Level::ERROR, "no " + what_ + " yet on " + topics_ + ", for " + age};
  if (silence > max_silence_)
    return Silence{WallUpdater::Level::ERROR, "no " + what_ + " for " + age + " on " + topics_};
  return std::nullopt;
}

/// Hz; none of too few.
std::optional<double> InputMonitor::rate() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (arrivals_.size() < kFewest) return std::nullopt;
  const double time = 1e-9 * static_cast<double>(arrivals_.back().stamp - arrivals_.front().stamp);
  if (time <= 0.0) return std::nullopt;  // they jumped
  return static_cast<double>(arrivals_.size() - 1) / time;
}

void InputMonitor::diagnose(WallUpdater::Status& status) {
  const std::optional<double> measured = rate();
  status.addf("rate [Hz]", "%.2f", measured.value_or(0.0));
  status.addf("expected [Hz]", "%g to %g", rates_.min_rate, rates_.max_rate);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status.add("topics", topics_);
  }
  if (const auto silent = silence())
    status.summary(silent->level, silent->text);
  else if (!measured)
    status.summary(WallUpdater::Level::OK, "just started, no rate is measured yet");
  else if (*measured < rates_.min_rate)
    status.summaryf(
        WallUpdater::Level::WARN,
        "only %.2f %s a second, at least %g are expected (diagnostics/min_rate): driver or network too slow?",
        *measured, what_.c_str(), rates_.min_rate);
  else if (*measured > rates_.max_rate)
    status.summaryf(WallUpdater::Level::WARN, "%.2f %s a second, at most %g are expected (diagnostics/max_rate)",
                    *measured, what_.c_str(), rates_.max_rate);
  else
    status.summaryf(WallUpdater::Level::OK, "%.2f %s a second", *measured, what_.c_str());
}

}  // namespace sdvo
