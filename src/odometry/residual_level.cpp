#include "stereo_descriptor_vo/odometry/residual_level.hpp"

#include <algorithm>

namespace sdvo {

double ResidualLevel::excess(double square) {
  constexpr double kMemory = 0.9;  // share of what was usual before that a pair leaves
  if (!usual_) usual_ = square;
  const double excess = *usual_ > 0.0 ? std::max(1.0, square / *usual_) : 1.0;
  usual_ = kMemory * *usual_ + (1.0 - kMemory) * square;
  return excess;
}

}  // namespace sdvo
