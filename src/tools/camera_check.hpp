#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../check/corner_pairs.hpp"
#include "../check/finding.hpp"
#include "../check/focus_check.hpp"
#include "../check/image_check.hpp"
#include "../check/lens_check.hpp"
#include "../check/mosaic_check.hpp"
#include "../check/mount_check.hpp"
#include "../check/odometry_check.hpp"
#include "../check/row_check.hpp"
#include "../config/pipeline_options.hpp"
#include "offline_run.hpp"
#include "recording.hpp"

namespace sdvo {

/// All steps of the check of a stereo camera. Each step relies on those before it.
class CameraCheck {
 public:
  /// `run`, which must outlive it, has the odometry of these pairs.
  CameraCheck(const PipelineOptions& options, const OfflineRun& run);

  /// The pair that `run` has just processed, with its features.
  void add(const RecordedPair& pair, const StereoFeatures& features);
  /// A pair that could not be used, and why.
  void addUnusable(const std::string& problem);

  /// Steps after a FAIL are open: that fault would be the cause of what they find.
  std::vector<CheckStep> steps(const ArrivalFindings& arrivals) const;

  cv::Mat rows() const { return rows_.map(); }
  /// The last pair that was used, left beside right, with lines along the rows, on which both show the same; empty:
  /// none.
  cv::Mat picture() const;

 private:
  Finding calibration() const;
  Finding rig() const;
  Finding mount(const std::optional<Eigen::Isometry3d>& T_base_camera) const;
  Finding load(double rate) const;

  const PipelineOptions options_;
  const ImageThresholds thresholds_;
  const OfflineRun& run_;
  CornerPairs corner_pairs_;
  RowCheck rows_;
  LensCheck lens_check_;
  MosaicCheck mosaic_;
  RepeatCheck repeats_;
  FocusCheck focus_;
  ImageCheck images_;
  EmitterCheck emitter_;
  OdometryCheck odometry_;
  std::vector<Eigen::Isometry3d> motions_;  ///< T_before_now of pairs that are TRACKING
  int used_ = 0, unusable_ = 0, refused_ = 0;
  std::string problem_, refusal_, lens_, unrectified_;
  StereoCamera camera_;
  cv::Mat picture_;
};

}  // namespace sdvo
