#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "../check/mosaic_check.hpp"
#include "../check/work_load.hpp"
#include "../config/pipeline_options.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_descriptor_vo/front_end/feature_extractor.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {

/// The pipeline of both nodelets without ROS: every pair it is given is processed, and all that comes out is kept.
class OfflineRun {
 public:
  /// Throws std::invalid_argument when an option is out of its range, or the patches are too small to be aligned.
  explicit OfflineRun(const PipelineOptions& options);

  /// Stamps (ns) must increase. Returns the pair's features.
  StereoFeatures process(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right, std::int64_t stamp,
                         double right_delay = 0.0);

  /// The same with the odometry of the previous pair in a second thread during this pair's extraction, as in the
  /// nodelets. Results are equal, and available after the next call or finish().
  void processBeside(const StereoCamera& camera, const cv::Mat& left, const cv::Mat& right, std::int64_t stamp,
                     double right_delay = 0.0);
  /// Returns the features of the last pair, if its odometry was not done yet.
  std::optional<StereoFeatures> finish();

  /// The next pair from its features alone, which were extracted elsewhere.
  void processFeatures(const StereoFeatures& features);

  struct Frame {
    OdometryResult odometry;  ///< only the last pair keeps its flow
    ExtractionReport extraction;
    double total_time = 0.0;  ///< s
  };
  const std::vector<Frame>& frames() const { return frames_; }
  const OdometryResult& last() const { return frames_.back().odometry; }

  int pairs() const { return static_cast<int>(frames_.size()); }
  int pairsWithoutPose() const;
  /// Changes of the epoch: motions of the pose that were not measured.
  int discontinuities() const;
  double distance() const;  ///< m

  /// Without decoding; zero without pairs. For processBeside() a pair is done when the next one is.
  PairTimes times() const;

  /// Whether images are a mosaic, in words; empty: they are not.
  std::string mosaic() const { return mosaic_.problem(); }

  /// Poses of the left camera, one for each pair: without one of its own a pair repeats the last one.
  Trajectory poses() const;
  /// `poses` (one for each pair) with their stamps, without the pairs for which the odometry had no pose.
  StampedTrajectory stamped(const Trajectory& poses) const;

  /// A CSV with a line for each pair: times, counts, state and its reason, in which semicolons stand for commas.
  void writeTiming(const std::string& path) const;
  /// A CSV with a line for each pair: state, covariances of motion and pose, reason.
  void writeStates(const std::string& path) const;

 private:
  /// A pair between extractor and odometry.
  struct Extracted {
    StereoFeatures features;
    double time;  ///< s, since the pair before
  };
  void track(const Extracted& pair);

  FeatureExtractor extractor_;
  MosaicCheck mosaic_;
  VisualOdometry odometry_;
  std::optional<Extracted> waiting_;  ///< for its odometry
  std::vector<Frame> frames_;
  double cpu_time_ = 0.0;  ///< s
};

}  // namespace sdvo
