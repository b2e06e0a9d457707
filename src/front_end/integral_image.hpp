#pragma once

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace sdvo {

/// Whether everything within `reach` px of (u, v) lies inside an image. Pixel p covers [p - 0.5, p + 0.5].
inline bool liesInside(double u, double v, double reach, cv::Size image) {
  return u - reach >= -0.5 && v - reach >= -0.5 && u + reach <= image.width - 0.5 && v + reach <= image.height - 0.5;
}

/// Mean intensities of boxes with real-valued position and side. Pixel p covers [p - 0.5, p + 0.5]; interpolating the
/// integral linearly gives the area-weighted sum.
class IntegralImage {
 public:
  /// `image` must be CV_8UC1; only its integral is kept.
  explicit IntegralImage(const cv::Mat& image) {
    CV_Assert(image.type() == CV_8UC1);
    cv::integral(image, sums_, CV_32S);
  }

  /// (rows + 1) x (columns + 1) sums, CV_32S. Sums beyond 2^31 wrap around, differences of them do not.
  const cv::Mat& sums() const { return sums_; }

  /// Mean grey level of the square around (u, v) with the given half side (all px). The square must lie inside the
  /// image. Rounded to 1/256, so that rounding errors of the sums do not make equal means different.
  float boxMean(float u, float v, float half) const {
    const Edge left = edge(u - half, sums_.cols), right = edge(u + half, sums_.cols);
    const Edge top = edge(v - half, sums_.rows), bottom = edge(v + half, sums_.rows);
    const auto between = [&](int upper, int lower) { return sumBetween(upper, lower, left, right); };
    const float sum = between(top.index, bottom.index) + bottom.share * between(bottom.index, bottom.index + 1) -
                      top.share * between(top.index, top.index + 1);
    // Not 4 half^2: the edges are rounded, too.
    return sum / (width(left, right) * width(top, bottom)) + kRounding - kRounding;
  }

  /// So large that a grey level added to it keeps eight bits behind the point.
  static constexpr float kRounding = 1.5f * (1 << 15);

 private:
  /// A position between two columns or two rows of the integral.
  struct Edge {
    int index;
    float share;  ///< of the second one
  };
  static Edge edge(float position, int size) {
    const float shifted = position + 0.5f;
    const int index = std::clamp(static_cast<int>(shifted), 0, size - 2);
    return {index, shifted - static_cast<float>(index)};
  }
  static float width(const Edge& first, const Edge& last) {
    return static_cast<float>(last.index - first.index) + (last.share - first.share);
  }

  /// Of the pixels between two rows of the integral, and two edges.
  float sumBetween(int upper, int lower, const Edge& left, const Edge& right) const {
    const auto column = [&](int x) {
      return static_cast<unsigned>(sums_.at<std::int32_t>(lower, x)) -
             static_cast<unsigned>(sums_.at<std::int32_t>(upper, x));
    };
    const auto across = [&](int from, int to) {
      return static_cast<float>(static_cast<std::int32_t>(column(to) - column(from)));
    };
    return across(left.index, right.index) + right.share * across(right.index, right.index + 1) -
           left.share * across(left.index, left.index + 1);
  }

  cv::Mat sums_;
};

}  // namespace sdvo
