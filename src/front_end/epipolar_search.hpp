#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// A pair with a margin, and the same at half resolution.
struct SearchedImages {
  static constexpr int kMargin = 64;  ///< px added around every image, so that no read needs a check

  cv::Mat left, right, left_half, right_half;
  cv::Mat half;  ///< one of them before it gets the margin

  void take(const cv::Mat& new_left, const cv::Mat& new_right);
};

/// Looks for single left positions along their rows of the right image.
class EpipolarSearch {
 public:
  EpipolarSearch(const StereoMatcherOptions& options, double max_disparity, double noise, const SearchedImages& images)
      : options_(options), max_disparity_(max_disparity), noise_(noise), images_(images) {}

  struct Found {
    cv::Point2f place;  ///< (disparity, dv), px
    float rival;        ///< px along the row to another block that may be as like, between two pixels; 0: none
  };
  std::optional<Found> find(const cv::Point2f& left_position) const;

  /// Distance along the row after which the left image shows the same, px, if the disparity may be off by it; else 0.
  /// The right image does not decide: what repeats there may be hidden, or beyond its border.
  float findPeriod(const cv::Point2f& left_position, double disparity) const;

 private:
  struct RowMatch {
    int disparity;  ///< px
    int rival;      ///< as in Found
  };
  std::optional<RowMatch> searchRow(const cv::Point2f& left_position) const;
  /// (disparity, dv) in the right image, or in another one, from a disparity to 2 px.
  std::optional<cv::Point2f> refine(const cv::Mat& other, const cv::Point2f& left_position, int disparity) const;
  cv::Point2f searchAround(const cv::Mat& other, const cv::Point& left, int disparity) const;
  std::optional<cv::Point2f> align(const cv::Mat& other, const cv::Point2f& left_position,
                                   const cv::Point2f& start) const;

  const StereoMatcherOptions& options_;
  double max_disparity_;
  double noise_;  ///< of the left image, grey levels
  const SearchedImages& images_;
};

}  // namespace sdvo
