#include "stamp_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Ratio of pairs that may be lost (chosen): drivers lose one now and then.
constexpr double kFew = 0.02;

/// Between successive pairs, s.
std::vector<double> periods(const std::vector<std::int64_t>& stamps) {
  std::vector<double> periods;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    periods.push_back(1e-9 * static_cast<double>(stamps[i] - stamps[i - 1]));
  return periods;
}

}  // namespace

void StampCheck::note(std::size_t input, std::int64_t stamp, double arrival) {
  ++counts_[input];
  if (input == 0) delays_.push_back(arrival - 1e-9 * static_cast<double>(stamp));
}

void StampCheck::notePair(std::int64_t stamp) {
  pairs_.push_back(stamp);
}

double StampCheck::rate() const {
  const double period = quantile(periods(pairs_), 0.5);
  return period > 0.0 ? 1.0 / period : 0.0;
}

Finding StampCheck::topics(double min_rate, double max_rate, const std::string& explanation) const {
  for (std::size_t input = 0; input < kInputs; ++input)
    if (counts_[input] == 0)
      return {Verdict::kFail, "nothing came on " + topics_[input],
              "start the driver with both sides, or give the names that it has (--camera, --left, --right, --image)"};
  if (pairs_.empty()) return {Verdict::kFail, explanation, "see docs/troubleshooting.md, synchronisation"};
  if (pairs_.size() < 2) return {Verdict::kOpen, "one pair alone", "take more of them"};
  const std::string what = text(1, pairs_.size(), " pairs, ", rate(), " Hz");
  return judged(false, rate() < min_rate || rate() > max_rate, what, "5 to 60 Hz suit, 15 Hz or more for fast turns");
}

Finding StampCheck::stamps() const {
  if (pairs_.size() < 2) return {Verdict::kOpen, "no pairs"};
  const double alone = 1.0 - static_cast<double>(pairs_.size()) / std::max(counts_[0], counts_[1]);
  const std::vector<double> steps = periods(pairs_);
  const double usual = quantile(steps, 0.5), longest = *std::max_element(steps.begin(), steps.end());
  const auto share = [&](const auto& is_bad) {
    return static_cast<double>(std::count_if(steps.begin(), steps.end(), is_bad)) / static_cast<double>(steps.size());
  };
  const double delay = quantile(delays_, 0.5);
  const std::string what = text(1, "longest gap ", 1e3 * longest, " ms, ", 100.0 * alone, " % without partner");

  if (share([](double step_time) { return step_time <= 0.0; }) > 0.0)
    return {Verdict::kWarn, "stamps fall; " + what, "one recording at a time, and a driver that does not restart"};
  if (std::abs(delay) > 1.0)
    return {Verdict::kWarn,
            text(0, "stamps are ", std::abs(delay), " s ", delay > 0.0 ? "behind" : "ahead of",
                 " the clock of arrivals: another clock"),
            "let the driver stamp with the system's clock: TF and filters compare stamps of several sources"};
  if (alone > kFew)
    return {Verdict::kWarn, what,
            "some images have no partner of the same stamp: trigger both cameras together, "
            "or look for losses on the way (network, USB)"};
  return judged(false, share([&](double step_time) { return step_time > 1.5 * usual; }) > kFew, what,
                "pairs are missing: look for losses on the way (USB, network, processor)");
}

Finding checkLatency(double latency, double most) {
  constexpr double kEpoch = 1e7;  // s, a third of a year
  constexpr double kAhead = 0.1;  // s, a step of the slowest simulated clocks (chosen)
  const std::string what = text(3, latency, " s from image to pose");
  if (std::isnan(latency))
    return {Verdict::kWarn, what, "use_sim_time is true, and nobody publishes /clock: rosbag play needs --clock"};
  if (latency > kEpoch)
    return {Verdict::kWarn, what,
            "the images have another clock than this machine: since its boot, or of a recording that is played "
            "without use_sim_time and --clock?"};
  if (latency > most)
    return {Verdict::kWarn, what, "is the machine too slow, or are the clocks of two machines different?"};
  return judged(false, latency < -kAhead, what,
                "the images are stamped in the future, where TF knows nothing yet: is the camera's clock that of this "
                "machine?");
}

}  // namespace sdvo
