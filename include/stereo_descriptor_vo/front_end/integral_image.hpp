#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
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
    // Whole numbers either way: the same means. The 32 bits that make it fast hold 8.4 million white pixels.
    constexpr std::size_t kFewPixels = std::numeric_limits<std::int32_t>::max() / 255;
    cv::integral(image, integral_, image.total() <= kFewPixels ? CV_32S : CV_64F);
  }

  /// (rows + 1) x (columns + 1) sums, CV_32S or CV_64F.
  const cv::Mat& sums() const { return integral_; }

  /// Mean grey level of the square around (u, v) with the given half side (all px). The square must lie inside the
  /// image. Rounded to float: means that are equal must compare so, whatever the sums were rounded to on the way.
  float boxMean(double u, double v, double half) const {
    return integral_.depth() == CV_32S ? meanOf<std::int32_t>(u, v, half) : meanOf<double>(u, v, half);
  }

 private:
  template <class Sum>
  float meanOf(double u, double v, double half) const {
    const Edge left = edge(u - half, integral_.cols), right = edge(u + half, integral_.cols);
    const Edge top = edge(v - half, integral_.rows), bottom = edge(v + half, integral_.rows);
    const auto between = [&](int row) {
      const Sum* sums = integral_.ptr<Sum>(row);
      return interpolated(sums[right.index], sums[right.index + 1], right.share) -
             interpolated(sums[left.index], sums[left.index + 1], left.share);
    };
    return static_cast<float>((interpolated(between(bottom.index), between(bottom.index + 1), bottom.share) -
                               interpolated(between(top.index), between(top.index + 1), top.share)) /
                              (4.0 * half * half));
  }

  /// A position between two columns or two rows of the integral.
  struct Edge {
    int index;
    double share;  ///< of the second one
  };
  static Edge edge(double position, int size) {
    const int index = std::clamp(static_cast<int>(position + 0.5), 0, size - 2);
    return {index, position + 0.5 - index};
  }
  static double interpolated(double a, double b, double share) { return a + share * (b - a); }

  cv::Mat integral_;  ///< (rows + 1) x (cols + 1), CV_32S or CV_64F
};

}  // namespace sdvo
