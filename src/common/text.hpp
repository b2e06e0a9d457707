#pragma once

#include <iomanip>
#include <sstream>
#include <string>

namespace sdvo {

/// Numbers with `digits` after the point, and words between them.
template <class... Parts>
std::string text(int digits, const Parts&... parts) {
  std::ostringstream stream;
  stream << std::fixed << std::setprecision(digits);
  (stream << ... << parts);
  return stream.str();
}

}  // namespace sdvo
