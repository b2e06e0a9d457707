#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "coarse_view.hpp"
#include "finding.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// Whether images are good ones to find features in: exposure, texture, motion blur, and how far the view moves from
/// pair to pair.
class ImageCheck {
 public:
  /// A pair (CV_8UC1) with what extraction reports of it.
  void add(const cv::Mat& left, const cv::Mat& right, const ExtractionReport& report);

  /// Mean grey levels outside of `min_intensity` to `max_intensity` are too dark and too bright.
  Finding exposure(double min_intensity, double max_intensity) const;
  /// `min_corners`: fewer are too few. `min_share`: of these, those found in the right image.
  Finding texture(int min_corners, double min_share) const;
  Finding blur() const;
  /// `rotations`: deg, of each pair whose motion is known.
  Finding frameRate(const std::vector<double>& rotations) const;

 private:
  CoarseView view_;
  std::vector<double> dark_, bright_, saturated_;  ///< of each pair: mean grey levels, share of white pixels
  std::vector<double> corners_, matched_;          ///< of each pair: number of corners, share found in the right image
  std::vector<double> sharpness_, moved_;  ///< of each pair after the first: grey levels a px; share of the width
  int lost_views_ = 0;                     ///< pairs without a common motion since the pair before
};

}  // namespace sdvo
