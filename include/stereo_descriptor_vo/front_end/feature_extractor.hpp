#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/front_end/depth_scale.hpp"
#include "stereo_descriptor_vo/front_end/feature_detector.hpp"
#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"
#include "stereo_descriptor_vo/front_end/rig_monitor.hpp"
#include "stereo_descriptor_vo/front_end/stereo_descriptor.hpp"
#include "stereo_descriptor_vo/front_end/stereo_matcher.hpp"

namespace sdvo {

struct FeatureExtractorOptions {
  FeatureDetectorOptions detector;
  StereoMatcherOptions stereo;
  RigMonitorOptions rig_monitor;
  DepthScaleOptions size_curve;
  DescriptorOptions descriptor;
  PatchOptions patch;

  void describe(OptionList& list) {
    list.group("detector", detector);
    list.group("stereo", stereo);
    list.group("rig_monitor", rig_monitor);
    list.group("size_curve", size_curve);
    list.group("descriptor", descriptor);
    list.group("descriptor", patch);
  }
  /// Throws std::invalid_argument when the size curve leaves no size.
  void check() const;

  /// The size curve with the descriptor's own values where the options leave them open.
  DepthScaleOptions sizeCurve() const { return size_curve.completedFor(descriptor.type); }
};

/// From a rectified stereo pair to its depth-scaled stereo descriptors. Stateless: equal input gives equal output.
class FeatureExtractor {
 public:
  /// Throws std::invalid_argument when an option is out of its range.
  explicit FeatureExtractor(const FeatureExtractorOptions& options);

  /// Images and `mask` are CV_8U of the camera's size, else std::invalid_argument. The mask is zero where parts of the
  /// robot are in view; if it is empty, the detector's own is used. A pair without features, or one that the rig
  /// monitor refuses, gives an empty set with the reason in its report. Rows that differ as by a small rotation of the
  /// right camera are followed; the report says so. `before`: report of the previous pair, to recognise a repeated
  /// image.
  StereoFeatures extract(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right, std::int64_t stamp,
                         const cv::Mat& mask = cv::Mat(), const ExtractionReport& before = {}) const;

  /// The size curve of features in images of this size (px): no size exceeds what the image has room for.
  DepthScaleOptions sizeCurve(cv::Size image) const;

  const FeatureExtractorOptions& options() const { return options_; }

 private:
  /// Stereo matches of a rig whose rows differ by a line.
  std::vector<StereoMatch> matchAlong(const RowLine& rows, const cv::Mat& left, const cv::Mat& right,
                                      const std::vector<cv::Point2f>& positions) const;
  /// Appends what both views describe of the matched corners.
  void describe(const cv::Mat& left, const cv::Mat& right, const std::vector<Corner>& corners,
                const std::vector<StereoMatch>& matches, StereoFeatures& features) const;

  FeatureExtractorOptions options_;
  FeatureDetector detector_;
  StereoMatcher stereo_matcher_;
  RigMonitor rig_monitor_;
  DepthScale depth_scale_;
  StereoDescriptor descriptor_;
};

}  // namespace sdvo
