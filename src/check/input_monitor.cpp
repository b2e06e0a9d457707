#include "input_monitor.hpp"

#include <cmath>
#include <cstddef>
#include <utility>

#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr double kWindow = 5.0;     // s (chosen), of the rate
constexpr std::size_t kFewest = 3;  // arrivals (chosen) that make one

}  // namespace

Finding checkRate(const std::string& what, double rate, const RateOptions& usual) {
  const std::string usually = text(1, usual.min_rate, " to ", usual.max_rate, " Hz are expected");
  return warnIf(rate < usual.min_rate || rate > usual.max_rate, what,
                usually + (rate > usual.max_rate ? "" : ", 15 Hz or more for fast turns: driver or network too slow?"));
}

Finding checkLatency(double latency, double most, const std::string& done, double ahead) {
  constexpr double kEpoch = 1e7;  // s, a third of a year
  const std::string what = text(3, latency, " s from image to ", done);
  if (std::isnan(latency))
    return {Verdict::kWarn, what, "use_sim_time is true, and nobody publishes /clock: rosbag play needs --clock"};
  if (std::abs(latency) > kEpoch)
    return {Verdict::kWarn, what,
            "the images have another clock than this machine: since its boot, or of a recording that is played "
            "without use_sim_time and --clock? Let the driver stamp with the system's"};
  if (latency > most)
    return {Verdict::kWarn, what, "is the machine too slow, or are the clocks of two machines different?"};
  return warnIf(latency < -ahead, what,
                "the images are stamped in the future, where TF knows nothing yet: is the camera's clock that of this "
                "machine?");
}

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

std::optional<Finding> InputMonitor::silence() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!idle_.empty()) return Finding{Verdict::kOk, idle_};
  const double silence = secondsSince(arrivals_.empty() ? begin_ : arrivals_.back().time);
  if (arrivals_.empty())
    return judged(
        silence > max_silence_, true,
        "no " + what_ + " yet on " + topics_ + (silence > max_silence_ ? text(0, ", for ", silence, " s") : ""));
  if (silence <= max_silence_) return std::nullopt;
  return Finding{Verdict::kFail, text(0, "no ", what_, " for ", silence, " s on ", topics_)};
}

/// Hz; none of too few.
std::optional<double> InputMonitor::rate() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (arrivals_.size() < kFewest) return std::nullopt;
  const double time = 1e-9 * static_cast<double>(arrivals_.back().stamp - arrivals_.front().stamp);
  if (time <= 0.0) return std::nullopt;  // stamps jumped back
  return static_cast<double>(arrivals_.size() - 1) / time;
}

Findings InputMonitor::judge(Values& values) {
  const std::optional<double> measured = rate();
  values.add("rate [Hz]", text(2, measured.value_or(0.0)));
  values.add("expected [Hz]", text(1, rates_.min_rate, " to ", rates_.max_rate));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    values.add("topics", topics_);
  }
  if (const auto silent = silence()) return {*silent};
  if (!measured) return {{Verdict::kOk, "just started, no rate is measured yet"}};
  return {checkRate(text(2, *measured, " ", what_, " a second"), *measured, rates_)};
}

}  // namespace sdvo
