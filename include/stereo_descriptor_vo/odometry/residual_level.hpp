#pragma once

#include <optional>

namespace sdvo {

/// What is usual among the residuals of successive pairs, or among the shares that do not agree at all. Where that of
/// one pair is larger (other light, blur, a camera that is late), its pose is known worse, by as much, than the
/// adjustment of all pairs together says.
class ResidualLevel {
 public:
  /// Takes in a pair's median squared residual, or such a share. Returns how many times the usual one that is; at
  /// least 1.
  double excess(double square);

 private:
  std::optional<double> usual_;
};

}  // namespace sdvo
