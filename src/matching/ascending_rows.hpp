#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

namespace sdvo {

/// The rows of `first` that `second` lacks. Both ascend.
inline std::vector<int> without(const std::vector<int>& first, const std::vector<int>& second) {
  std::vector<int> rest;
  std::set_difference(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(rest));
  return rest;
}

}  // namespace sdvo
