#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "../rig/row_delay.hpp"
#include "corner_pairs.hpp"
#include "finding.hpp"

namespace sdvo {

/// Row differences between both images over a recording: errors of the rectification, and delay of the right image.
class RowCheck {
 public:
  /// `max_dv`: largest row difference of features, px. `max_disparity`, `reach`: search range along and across rows,
  /// px.
  RowCheck(double max_dv, double max_disparity, double reach)
      : max_dv_(max_dv), max_disparity_(max_disparity), reach_(reach) {}

  void add(const CornerPair& pair);

  Finding rectification() const;
  Finding sameMoment() const;

  /// Median of v_right - v_left (px) in each part of the image (RowDelay's), without the delay's effect. CV_64F; NaN
  /// with fewer than ten corners.
  cv::Mat map() const;

 private:
  double max_dv_, max_disparity_, reach_;
  int corners_ = 0;
  std::vector<RowDelay::Sample> samples_;
  RowDelay delay_{1.0, 10.0};  ///< px/s of the least turning: there a delay of 10 ms shifts rows by 0.1 px
};

/// Whether left and right images are taken at one moment.
Finding checkMoment(const RowDelay::Estimate& right);

}  // namespace sdvo
