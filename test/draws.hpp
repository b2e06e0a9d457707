#pragma once

#include <Eigen/Core>

namespace sdvo::synthetic {

/// N numbers of a distribution, the last one first. Arguments of a call that each draw one would be drawn in the order
/// of the compiler, which on arm64 is another one than on amd64.
template <int N, class Distribution, class Random>
Eigen::Matrix<double, N, 1> draw(Distribution& distribution, Random& random) {
  Eigen::Matrix<double, N, 1> drawn;
  for (int i = N; i-- > 0;) drawn[i] = distribution(random);
  return drawn;
}

}  // namespace sdvo::synthetic
