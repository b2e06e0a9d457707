#pragma once

#include <array>
#include <random>

#include "stereo_descriptor_vo/common/cpp17.hpp"

namespace sdvo {

/// Indices of the correspondences that a minimal solver takes.
using MinimalSample = std::array<int, 3>;

/// Three different indices below `count`, drawn evenly.
MinimalSample drawSample(std::mt19937& random, int count);

/// Tells when enough samples were drawn: once it is likely that one of them was without outliers, but within limits.
class SampleBudget {
 public:
  /// `confidence`: probability that a sample without outliers is among those drawn.
  SampleBudget(int at_most, double confidence);

  /// Takes note of the share of inliers of the best pose so far.
  void noteInliers(double share);

  bool spent(int samples) const;
  /// Share of the budget that is used up, 0…1.
  double progress(int samples) const;

 private:
  double at_most_, confidence_;
  double needed_;
};

}  // namespace sdvo
