#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace sdvo {

/// The upper median: of an even number of values the larger of the middle two. Zero of none. Reorders the values.
inline double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The quantile of `share` (0 to 1), by the nearest rank; zero of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Square of the quantile of Student's distribution, divided by `freedom`, where that of the normal distribution is
/// `square`: an upper bound, or an approximation with the `correction` (8 f + 3) / (8 f + 1) (Wallace 1959).
inline double studentSquare(double square, double freedom, double correction = 1.0) {
  return std::expm1(square / freedom * correction * correction);
}

/// Probability of at least `successes` in independent trials; `probability` of each in (0, 1).
inline double binomialTail(int trials, int successes, double probability) {
  double tail = 0.0;
  for (int k = successes; k <= trials; ++k)
    tail += std::exp(std::lgamma(trials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(trials - k + 1.0) +
                     k * std::log(probability) + (trials - k) * std::log1p(-probability));
  return tail;
}

}  // namespace sdvo
