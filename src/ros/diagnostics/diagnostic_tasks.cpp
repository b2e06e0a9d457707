#include "diagnostic_tasks.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "../../common/text.hpp"

namespace sdvo {
namespace {

constexpr double kWindow = 5.0;     // s, of the rate
constexpr std::size_t kFewest = 3;  // arrivals that make one

struct Words {
  const char* name;
  const char* remedy;
  bool is_rare;  ///< a single one is a fault
};

/// In the order of the causes.
constexpr std::array<Words, UnusedInput::kCauses> kWords = {
    {{"unpaired", "", false},
     {"pushed out by newer ones", "", false},
     {"late or with wrong stamps", "check the driver's stamps", true},
     {"refused", "the log says why", true},
     {"without a guess of the motion", "guess_timeout, or the source of the guess", false},
     {"messages of the IMU refused", "the log says why", true}}};

}  // namespace

void WallUpdater::print(const Findings& findings, Status& status) {
  for (const Finding& finding : findings) {
    const auto level = finding.verdict == Verdict::kFail   ? Level::ERROR
                       : finding.verdict == Verdict::kWarn ? Level::WARN
                                                           : Level::OK;
    if (&finding == &findings.front())
      status.summary(level, finding.text());
    else
      status.mergeSummary(level, finding.text());
  }
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

Findings InputMonitor::judge(WallUpdater::Status& values) {
  const std::optional<double> measured = rate();
  values.add("rate [Hz]", text(2, measured.value_or(0.0)));
  values.add("expected [Hz]", text(1, rates_.min_rate, " to ", rates_.max_rate));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    values.add("topics", topics_);
  }
  if (const auto silent = silence()) return {*silent};
  if (!measured) return {{Verdict::kOk, "just started, no rate is measured yet"}};
  const std::string what = text(2, *measured, " ", what_, " a second");
  if (*measured < rates_.min_rate)
    return {{Verdict::kWarn,
             text(1, "only ", what, ", at least ", rates_.min_rate, " are expected (diagnostics/min_rate)"),
             "driver or network too slow?"}};
  if (*measured > rates_.max_rate)
    return {{Verdict::kWarn, text(1, what, ", at most ", rates_.max_rate, " are expected (diagnostics/max_rate)")}};
  return {{Verdict::kOk, what}};
}

Findings UnusedInput::judge(Finding first, WallUpdater::Status& values) {
  constexpr std::size_t kCalls = 6;  // five seconds
  constexpr std::uint64_t kFew = 3;  // unused ones (chosen): fewer are an accident
  Findings findings = {std::move(first)};
  Counts now;
  std::copy(counts_.begin(), counts_.end(), now.begin());
  now.back() = used_;
  history_.push_back(now);
  if (history_.size() > kCalls) history_.pop_front();
  const Counts& before = history_.front();
  const Counts& last = history_[history_.size() < 2 ? 0 : history_.size() - 2];
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    const Words& words = kWords[cause];
    if (cause <= kRefused || now[cause] > 0) values.add(words.name, now[cause]);
    const Counts& then = words.is_rare ? last : before;
    const std::uint64_t unused = now[cause] > then[cause] ? now[cause] - then[cause] : 0;
    const std::uint64_t all = now.back() - then.back() + (cause == kNoGuess ? 0 : unused);
    const bool is_much = unused >= kFew && static_cast<double>(unused) > max_share_ * static_cast<double>(all);
    if (unused == 0 || !(words.is_rare || is_much) || explained_.count(static_cast<int>(cause)) > 0) continue;
    findings.push_back(
        {Verdict::kWarn,
         text(0, unused, words.is_rare ? " " : text(0, " of ", all, " "), cause == kImu ? "" : what_ + " ", words.name),
         words.remedy});
  }
  return findings;
}

Findings WorkLoad::judge(WallUpdater::Status& values) {
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
  if (dropped > 0) return {{Verdict::kWarn, "too slow: " + loss + "; set fewer detector/max_features or a max_rate"}};
  return {judged(false, load > max_load_, text(0, 100.0 * load, " % of one processor's time"))};
}

}  // namespace sdvo
