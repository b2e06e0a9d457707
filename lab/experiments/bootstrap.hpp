#pragma once

#include <functional>
#include <vector>

namespace sdvo {

struct Interval {
  double low, high;
};

/// The 95 % percentile interval of a statistic of `count` independent units, such as drives: its values over units
/// drawn with replacement (Efron 1979). `statistic` is given the indices drawn. Not a number where a value is none and
/// for fewer than two units, which tell nothing of their spread. Deterministic.
Interval bootstrap(int count, const std::function<double(const std::vector<int>&)>& statistic);

/// The same of the mean.
Interval bootstrapMean(const std::vector<double>& values);

}  // namespace sdvo
