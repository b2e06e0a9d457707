#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "finding.hpp"

namespace sdvo {

/// How wide edges are, whatever the noise: a lens out of focus widens all of them, in both directions.
class FocusCheck {
 public:
  /// The next pair, CV_8UC1.
  void add(const cv::Mat& left, const cv::Mat& right);

  Finding judge() const;

 private:
  /// Mean squared differences between pixels that are 2, 4 and 8 px apart, summed over the pairs. Noise adds the same
  /// to each.
  using Differences = std::array<double, 3>;

  std::array<std::array<Differences, 2>, 2> sums_{};  ///< by side, along rows and along columns
  int pairs_ = 0;
};

}  // namespace sdvo
