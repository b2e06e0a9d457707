#include "unused_input.hpp"

#include <algorithm>
#include <cstddef>

namespace sdvo {
namespace {

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

void UnusedInput::diagnose(WallUpdater::Status& status) {
  constexpr std::size_t kCalls = 6;     // five seconds
  constexpr std::uint64_t kFewest = 3;  // unused ones (chosen): fewer are an accident
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
    const bool is_much = unused >= kFewest && static_cast<double>(unused) > max_share_ * static_cast<double>(all);
    if (unused == 0 || !(words.is_rare || is_much) || explained_.count(static_cast<int>(cause)) > 0) continue;
    status.mergeSummary(WallUpdater::Level::WARN, std::to_string(unused) +
                                                      (words.is_rare ? " " : " of " + std::to_string(all) + " ") +
                                                      (cause == kImu ? "" : what_ + " ") + words.name + words.remedy);
  }
}

}  // namespace sdvo
