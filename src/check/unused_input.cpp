#include "unused_input.hpp"

#include <algorithm>
#include <cstddef>

#include "../common/text.hpp"

namespace sdvo {
namespace {

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

Findings UnusedInput::judge(Finding first, Values& values) {
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

}  // namespace sdvo
