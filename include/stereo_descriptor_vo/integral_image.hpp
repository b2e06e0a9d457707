#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace sdvo {

/// Mean intensities of boxes with real-valued position and side. Pixel p covers [p - 0.5, p + 0.5]; interpolating the
/// integral linearly gives the exact area-weighted sum.
class IntegralImage {
 public:
  /// `image` must be CV_8UC1; only its integral is kept.
  explicit IntegralImage(const cv::Mat& image) {
    CV_Assert(image.type() == CV_8UC1);
    cv::integral(image, integral_, CV_32S);
  }

  /// Mean grey level of the square around (u, v) with the given half side (all px). The square must lie inside the image.
  double boxMean(double u, double v, double half) const {
    const double x0 = u - half, x1 = u + half, y0 = v - half, y1 = v + half;
    return (at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)) / (4.0 * half * half);
  }

 private:
  double at(double x, double y) const {
    const double column = x + 0.5, row = y + 0.5;
    const int c = std::clamp(static_cast<int>(column), 0, integral_.cols - 2);
    const int r = std::clamp(static_cast<int>(row), 0, integral_.rows - 2);
    const double a = column - c, b = row - r;
    const int* upper = integral_.ptr<int>(r) + c;
    const int* lower = integral_.ptr<int>(r + 1) + c;
    return (1.0 - b) * ((1.0 - a) * upper[0] + a * upper[1]) + b * ((1.0 - a) * lower[0] + a * lower[1]);
  }

  cv::Mat integral_;  ///< (rows + 1) x (cols + 1), CV_32S
};

}  // namespace sdvo
