#include "bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace sdvo {

Interval bootstrap(int count, const std::function<double(const std::vector<int>&)>& statistic) {
  constexpr int kDraws = 5000;
  constexpr double kOutside = 0.025;  // on each side
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (count < 2) return {kUnknown, kUnknown};
  std::mt19937 random(1);
  std::vector<int> drawn(static_cast<std::size_t>(count));
  std::vector<double> values;
  for (int draw = 0; draw < kDraws; ++draw) {
    for (int& index : drawn) index = static_cast<int>(random() % static_cast<unsigned>(count));
    values.push_back(statistic(drawn));
    if (!std::isfinite(values.back())) return {kUnknown, kUnknown};
  }
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double share) {
    return values[static_cast<std::size_t>(std::lround(share * (kDraws - 1)))];
  };
  return {quantile(kOutside), quantile(1.0 - kOutside)};
}

Interval bootstrapMean(const std::vector<double>& values) {
  return bootstrap(static_cast<int>(values.size()), [&](const std::vector<int>& drawn) {
    double sum = 0.0;
    for (const int index : drawn) sum += values[static_cast<std::size_t>(index)];
    return sum / static_cast<double>(drawn.size());
  });
}

}  // namespace sdvo
