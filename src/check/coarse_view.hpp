#pragma once

#include <opencv2/core.hpp>
#include <optional>

namespace sdvo {

/// An image at about a hundred columns, where the motion of the view is large and small bright dots average out.
class CoarseView {
 public:
  CoarseView() = default;
  /// `image` is CV_8UC1.
  explicit CoarseView(const cv::Mat& image);

  bool empty() const { return view_.empty(); }
  cv::Size size() const { return view_.size(); }

  /// Where most of `part` (a rectangle of the coarse view) has moved since `before`, as a share of the image's width.
  /// Nothing when the views have no common motion.
  std::optional<cv::Point2d> motionSince(const CoarseView& before, const cv::Rect& part) const;
  std::optional<cv::Point2d> motionSince(const CoarseView& before) const {
    return motionSince(before, cv::Rect(cv::Point(), size()));
  }

 private:
  cv::Mat view_;  ///< CV_64F, grey levels
};

}  // namespace sdvo
