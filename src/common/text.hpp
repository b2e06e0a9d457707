#pragma once

#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>
#include <string>
#include <type_traits>

namespace sdvo {

/// Numbers with `digits` after the point, and words between them. A wild number has an exponent, not hundreds of
/// digits. In the C locale, whatever a nodelet of this process has set.
template <class... Parts>
std::string text(int digits, const Parts&... parts) {
  constexpr double kWild = 1e12;
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  const auto put = [&](const auto& part) {
    if constexpr (std::is_floating_point_v<std::decay_t<decltype(part)>>)
      stream << (std::abs(part) < kWild ? std::fixed : std::scientific) << std::setprecision(digits) << part;
    else
      stream << part;
  };
  (put(parts), ...);
  return stream.str();
}

}  // namespace sdvo
