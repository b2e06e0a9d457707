#pragma once

#include <cmath>

namespace sdvo {

/// Probability of at least so many successes in independent trials that succeed with a probability in (0, 1).
inline double binomialTail(int trials, int successes, double probability) {
  double tail = 0.0;
  for (int k = successes; k <= trials; ++k)
    tail += std::exp(std::lgamma(trials + 1.0) - std::lgamma(k + 1.0) - std::lgamma(trials - k + 1.0) +
                     k * std::log(probability) + (trials - k) * std::log1p(-probability));
  return tail;
}

}  // namespace sdvo
