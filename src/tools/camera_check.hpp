#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../check/finding.hpp"
#include "../check/image_check.hpp"
#include "../check/odometry_check.hpp"
#include "../check/row_check.hpp"
#include "../check/stamp_check.hpp"
#include "../config/pipeline_options.hpp"
#include "../ros/pair_decoder.hpp"
#include "offline_run.hpp"

namespace sdvo {

/// All steps of the check of a stereo camera, in the order in which one proves what the next one needs.
class CameraCheck {
 public:
  explicit CameraCheck(const PipelineOptions& options);

  /// Pairs in the order of their stamps.
  void add(const StereoPairMessages& pair);

  /// `topics`, `stamps` and `transform` are judged where messages arrive. A step after a FAIL is open: its findings
  /// would be that fault's.
  std::vector<Finding> findings(const Finding& topics, const Finding& stamps, const Finding& transform,
                                double rate) const;

  cv::Mat rows() const { return rows_.map(); }
  /// The last pair that was used, left above right; empty: none.
  const cv::Mat& picture() const { return picture_; }

 private:
  Finding calibration() const;
  Finding rig() const;
  Finding load(double rate) const;

  const PipelineOptions options_;
  const ImageThresholds thresholds_;
  OfflineRun run_;
  PairDecoder decoder_;
  RowCheck rows_;
  ImageCheck images_;
  EmitterCheck emitter_;
  OdometryCheck odometry_;
  std::int64_t last_stamp_ = 0;  ///< ns
  int used_ = 0, unusable_ = 0, refused_ = 0;
  std::string problem_, refusal_, lens_, unrectified_;
  StereoCamera camera_;
  cv::Mat picture_;
};

}  // namespace sdvo
