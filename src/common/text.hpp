#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iomanip>
#include <numeric>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace sdvo {

/// Numbers with `digits` after the point, and words between them. A wild number has an exponent, not hundreds of
/// digits.
template <class... Parts>
std::string text(int digits, const Parts&... parts) {
  constexpr double kWild = 1e12;
  std::ostringstream stream;
  const auto put = [&](const auto& part) {
    if constexpr (std::is_floating_point_v<std::decay_t<decltype(part)>>)
      stream << (std::abs(part) < kWild ? std::fixed : std::scientific) << std::setprecision(digits) << part;
    else
      stream << part;
  };
  (put(parts), ...);
  return stream.str();
}

/// Whether two names differ by few letters, apart from capitals, `_` and `-`.
inline bool isAlike(const std::string& a, const std::string& b) {
  const auto letters = [](const std::string& name) {
    std::string kept;
    for (const unsigned char c : name)
      if (std::isalnum(c)) kept += static_cast<char>(std::tolower(c));
    return kept;
  };
  const std::string from = letters(a), to = letters(b);
  std::vector<std::size_t> row(to.size() + 1);  // Levenshtein distances of the first i letters to the first j
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < to.size(); ++j)
      diagonal = std::exchange(row[j + 1], std::min(std::min(row[j], row[j + 1]) + 1, diagonal + (from[i] != to[j])));
  }
  return 5 * row.back() <= to.size();  // two of the ten and more letters of this package's names
}

}  // namespace sdvo
