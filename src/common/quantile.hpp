#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace sdvo {

/// The value that `share` (0 to 1) of all are not above; zero of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace sdvo
