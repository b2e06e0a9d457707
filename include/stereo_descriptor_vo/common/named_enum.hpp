#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Name of an enum's value, by which files, messages and people refer to it. Such an enum counts up from 0 and has a
/// function `const std::vector<std::string>& namesOf(Enum)` beside it, which lists the names in that order.
template <class Enum>
const std::string& nameOf(Enum value) {
  return namesOf(value).at(static_cast<std::size_t>(value));
}

/// Position of a name in a list of names, or nothing.
inline std::optional<int> indexOf(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<int>(found - names.begin());
}

/// "'blue' is none of: red, green".
inline std::string noneOf(const std::vector<std::string>& names, const std::string& name) {
  std::string text = "'" + name + "' is none of";
  for (const std::string& known : names) text += (&known == &names.front() ? ": " : ", ") + known;
  return text;
}

/// The value of that name; throws std::invalid_argument that lists the names when there is none.
template <class Enum>
Enum valueOf(const std::string& name) {
  const std::vector<std::string>& names = namesOf(Enum{});
  const std::optional<int> index = indexOf(names, name);
  if (!index) throw std::invalid_argument(noneOf(names, name));
  return static_cast<Enum>(*index);
}

}  // namespace sdvo
