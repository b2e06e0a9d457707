#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "../rig/row_delay.hpp"
#include "corner_pairs.hpp"
#include "finding.hpp"

namespace sdvo {

/// Rows of both images over a whole recording: how far the rectification leaves them apart, and how much later the
/// right image was taken.
class RowCheck {
 public:
  /// `max_dv`, px: rows of features may differ by that. `max_disparity`, `reach`, px: how far corners are looked for.
  RowCheck(double max_dv, double max_disparity, double reach)
      : max_dv_(max_dv), max_disparity_(max_disparity), reach_(reach) {}

  void add(const CornerPair& pair);

  Finding rectification() const;
  Finding sameMoment() const;

  /// Median of v_right - v_left (px) in each cell of the image, delay removed; a cell a part of RowDelay, CV_64F, NaN
  /// where fewer than ten corners were found.
  cv::Mat map() const;

 private:
  struct Sample {
    int cell;
    double dv;        ///< px
    double velocity;  ///< of the point's row, px/s
  };

  double max_dv_, max_disparity_, reach_;
  int corners_ = 0;
  std::vector<Sample> samples_;
  RowDelay delay_{1.0, 10.0};  ///< 10 ms are a tenth of a pixel then
};

/// Whether right images are of the same moment as left ones.
Finding checkMoment(const RowDelay::Estimate& right);

}  // namespace sdvo
