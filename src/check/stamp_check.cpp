#include "stamp_check.hpp"

#include <algorithm>
#include <cmath>

#include "../common/statistics.hpp"
#include "../common/text.hpp"

namespace sdvo {
namespace {

/// Chosen: what a driver loses now and then is no fault.
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
  arrivals_[input].push_back({stamp, arrival});
}

void StampCheck::notePair(std::int64_t stamp) {
  pairs_.push_back(stamp);
}

double StampCheck::rate() const {
  const double period = quantile(periods(pairs_), 0.5);
  return period > 0.0 ? 1.0 / period : 0.0;
}

Finding StampCheck::topics(double min_rate, double max_rate, const std::string& explanation) const {
  const std::string step = "topics";
  for (std::size_t input = 0; input < kInputs; ++input)
    if (arrivals_[input].empty())
      return {step, Verdict::kFail, "nothing came on " + topics_[input],
              "start the driver with both sides, or give the names that it has (--camera, --left, --right, --image)"};
  if (pairs_.empty()) return {step, Verdict::kFail, explanation, "see docs/troubleshooting.md, synchronisation"};
  if (pairs_.size() < 2) return {step, Verdict::kOpen, "one pair alone", "take more of them"};
  const std::string what = text(1, pairs_.size(), " pairs, ", rate(), " Hz");
  if (rate() < min_rate || rate() > max_rate)
    return {step, Verdict::kWarn, what, "5 to 60 Hz suit, 15 Hz or more for fast turns"};
  return {step, Verdict::kOk, what, ""};
}

Finding StampCheck::stamps() const {
  const std::string step = "stamps";
  if (pairs_.size() < 2) return {step, Verdict::kOpen, "no pairs", ""};
  const double images = static_cast<double>(std::max(arrivals_[0].size(), arrivals_[1].size()));
  const double alone = 1.0 - static_cast<double>(pairs_.size()) / images;
  const std::vector<double> steps = periods(pairs_);
  const double usual = quantile(steps, 0.5), longest = *std::max_element(steps.begin(), steps.end());
  const auto share = [&](const auto& is_bad) {
    return static_cast<double>(std::count_if(steps.begin(), steps.end(), is_bad)) / static_cast<double>(steps.size());
  };
  std::vector<double> delays;
  for (const Arrival& image : arrivals_[0]) delays.push_back(image.arrival - 1e-9 * static_cast<double>(image.stamp));
  const double delay = quantile(delays, 0.5);
  const std::string what = text(1, "longest gap ", 1e3 * longest, " ms, ", 100.0 * alone, " % without partner");

  if (share([](double step_time) { return step_time <= 0.0; }) > 0.0)
    return {step, Verdict::kWarn, "stamps fall; " + what,
            "one recording at a time, and a driver that does not restart"};
  if (std::abs(delay) > 1.0)
    return {step, Verdict::kWarn,
            text(0, "stamps are ", std::abs(delay), " s ", delay > 0.0 ? "behind" : "ahead of",
                 " the clock of arrivals: another clock"),
            "let the driver stamp with the system's clock: TF and filters compare stamps of several sources"};
  if (alone > kFew)
    return {step, Verdict::kWarn, what,
            "some images have no partner of the same stamp: trigger both cameras together, "
            "or look for losses on the way (network, USB)"};
  if (share([&](double step_time) { return step_time > 1.5 * usual; }) > kFew)
    return {step, Verdict::kWarn, what, "pairs are missing: look for losses on the way (USB, network, processor)"};
  return {step, Verdict::kOk, what, ""};
}

}  // namespace sdvo
