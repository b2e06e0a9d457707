#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/options/feature_extractor_options.hpp"

namespace sdvo {

/// From a rectified stereo pair to its depth-scaled stereo descriptors. Stateless: equal input gives equal output.
class FeatureExtractor {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit FeatureExtractor(const FeatureExtractorOptions& options);
  ~FeatureExtractor();

  /// Images and `mask` are CV_8U of the camera's size, else std::invalid_argument. The mask is zero where parts of the
  /// robot are in view; if it is empty, the detector's own is used. A pair without features, or one that the rig
  /// monitor refuses, gives an empty set with the reason in its report. Rows that differ as by a small rotation of the
  /// right camera are followed; the report says so. `before`: report of the previous pair, to recognise a repeated
  /// image.
  StereoFeatures extract(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right, std::int64_t stamp,
                         const cv::Mat& mask = cv::Mat(), const ExtractionReport& before = {}) const;

  /// The size curve of features in images of this size (px): no size exceeds what the image has room for.
  DepthScaleOptions sizeCurve(cv::Size image) const;

  const FeatureExtractorOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace sdvo
