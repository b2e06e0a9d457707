#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../config/pipeline_options.hpp"
#include "arrival_log.hpp"
#include "corner_pairs.hpp"
#include "finding.hpp"
#include "focus_check.hpp"
#include "image_check.hpp"
#include "lens_check.hpp"
#include "mosaic_check.hpp"
#include "mount_check.hpp"
#include "odometry_check.hpp"
#include "row_check.hpp"
#include "work_load.hpp"

namespace sdvo {

/// A rectified pair of a recording.
struct RecordedPair {
  StereoCamera camera;
  cv::Mat left, right;       ///< CV_8U grey; valid as long as the call that it is given to
  std::int64_t stamp;        ///< ns
  std::string lens;          ///< the calibration's model in words; empty: unknown
  std::string unrectified;   ///< evidence that the images are not rectified; empty: none
  double right_delay = 0.0;  ///< s, of the right image by its stamp, where approximate_sync pairs them
};

/// All steps of the check of a stereo camera. Each step relies on those before it.
class CameraCheck {
 public:
  explicit CameraCheck(const PipelineOptions& options);

  /// A pair with its features and its odometry.
  void add(const RecordedPair& pair, const StereoFeatures& features, const OdometryResult& result);
  /// A pair that could not be used, and why.
  void addUnusable(const std::string& problem);

  /// Steps after a FAIL are open: that fault would be the cause of what they find.
  std::vector<CheckStep> steps(const ArrivalFindings& arrivals, const PairTimes& times) const;

  cv::Mat rows() const { return rows_.map(); }
  /// The last pair that was used, left beside right, with lines along the rows, on which both show the same; empty:
  /// none.
  cv::Mat picture() const;

 private:
  Finding calibration() const;
  Finding mount(const std::optional<Eigen::Isometry3d>& T_base_camera) const;

  const PipelineOptions options_;
  const ImageThresholds thresholds_;
  CornerPairs corner_pairs_;
  RowCheck rows_;
  LensCheck lens_check_;
  MosaicCheck mosaic_;
  RepeatCheck repeats_;
  FocusCheck focus_;
  ImageCheck images_;
  EmitterCheck emitter_;
  OdometryCheck odometry_;
  RefusalCheck refusals_;
  std::vector<Eigen::Isometry3d> motions_;  ///< T_previous_current of pairs that are TRACKING
  int unusable_ = 0;
  std::string problem_, lens_, unrectified_;
  StereoCamera camera_;
  cv::Mat picture_;
};

}  // namespace sdvo
