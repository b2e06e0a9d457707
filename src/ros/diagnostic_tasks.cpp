#include "diagnostic_tasks.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "../common/text.hpp"

namespace sdvo {
namespace {

constexpr double kWindow = 5.0;     // s, of the rate
constexpr std::size_t kFewest = 3;  // arrivals that make one

struct Words {
  const char* name;
  const char* remedy;
  bool is_rare;  ///< one is a fault already
};

/// In the order of the causes.
constexpr std::array<Words, UnusedInput::kCauses> kWords = {
    {{"unpaired", "", false},
     {"pushed out by newer ones", "", false},
     {"late or with wrong stamps", ": check the driver's stamps", true},
     {"refused", ": the log says why", true},
     {"without a guess of the motion", ": guess_timeout, or the source of the guess", false},
     {"messages of the IMU refused", ": the log says why", true}}};

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

void UnusedInput::diagnose(WallUpdater::Status& status) {
  constexpr std::size_t kCalls = 6;  // five seconds
  constexpr std::uint64_t kFew = 3;  // unused ones (chosen): fewer are an accident
  Counts now;
  std::copy(counts_.begin(), counts_.end(), now.begin());
  now.back() = used_;
  history_.push_back(now);
  if (history_.size() > kCalls) history_.pop_front();
  const Counts& first = history_.front();
  const Counts& last = history_[history_.size() < 2 ? 0 : history_.size() - 2];
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    const Words& words = kWords[cause];
    if (cause <= kRefused || now[cause] > 0) status.add(words.name, now[cause]);
    const Counts& then = words.is_rare ? last : first;
    const std::uint64_t unused = now[cause] > then[cause] ? now[cause] - then[cause] : 0;
    const std::uint64_t all = now.back() - then.back() + (cause == kNoGuess ? 0 : unused);
    const bool is_much = unused >= kFew && static_cast<double>(unused) > max_share_ * static_cast<double>(all);
    if (unused == 0 || !(words.is_rare || is_much) || explained_.count(static_cast<int>(cause)) > 0) continue;
    status.mergeSummary(WallUpdater::Level::WARN, std::to_string(unused) +
                                                      (words.is_rare ? " " : " of " + std::to_string(all) + " ") +
                                                      (cause == kImu ? "" : what_ + " ") + words.name + words.remedy);
  }
}

}  // namespace sdvo
