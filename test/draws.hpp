#pragma once

#include <Eigen/Core>

namespace sdvo::synthetic {

/// N random numbers, the last one first, so that all compilers make the same scenes. C++ leaves the order of a call's
/// arguments open: `f(draw(), draw())` draws in another order on arm64 than on amd64.
template <int N, class Distribution, class Random>
Eigen::Matrix<double, N, 1> draw(Distribution& distribution, Random& random) {
  Eigen::Matrix<double, N, 1> drawn;
  for (int i = N; i-- > 0;) drawn[i] = distribution(random);
  return drawn;
}

}  // namespace sdvo::synthetic
