#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "coarse_view.hpp"
#include "finding.hpp"

namespace sdvo {

/// Finds the dots of a pattern projector: they stay where they are in the image while the scene moves.
class EmitterCheck {
 public:
  /// The left image of the next pair, CV_8UC1. Cheap while nothing moves.
  void add(const cv::Mat& image);

  Finding judge() const;

 private:
  CoarseView view_;             ///< where the scene was last compared
  cv::Mat dots_;                ///< CV_8U, 1 where a dot is
  int age_ = 0;                 ///< pairs since then
  std::vector<double> stayed_;  ///< of each comparison, share of the dots that stayed beyond chance
};

}  // namespace sdvo
