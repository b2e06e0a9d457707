#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "finding.hpp"

namespace sdvo {

/// Rows of both images over a whole recording: how far the rectification leaves them apart, and how much later the
/// right image was taken. A point that moves up or down in the image at v' px/s is seen v' * delay px lower by a camera
/// that is late, while an error of the rectification stays where it is.
class RowCheck {
 public:
  static constexpr int kColumns = 6, kRows = 4;

  /// `max_dv`, px: rows of features may differ by that. `max_disparity`, `reach`, px: how far corners are looked for.
  RowCheck(double max_dv, double max_disparity, double reach)
      : max_dv_(max_dv), max_disparity_(max_disparity), reach_(reach) {}

  /// The next pair, CV_8UC1 of one size; `stamp` in ns.
  void add(const cv::Mat& left, const cv::Mat& right, std::int64_t stamp);

  Finding rectification() const;
  Finding sameMoment() const;

  /// Median of v_right - v_left (px) in each cell of the image, delay removed; kRows x kColumns of CV_64F, NaN where
  /// fewer than ten corners were found.
  cv::Mat map() const;

 private:
  struct Sample {
    int pair, cell;
    double dv;        ///< px
    double velocity;  ///< of the point's row, px/s
  };

  /// How much later the right image is, s, with its standard deviation; none while rows hardly move.
  struct Delay {
    double value, sigma;
  };
  std::optional<Delay> delay() const;
  double compensation() const;

  double max_dv_, max_disparity_, reach_;
  cv::Size size_;
  cv::Mat before_;  ///< the left image of the pair before
  std::int64_t stamp_before_ = 0, last_ = 0;
  int pairs_ = 0, corners_ = 0;
  std::vector<Sample> samples_;
};

}  // namespace sdvo
