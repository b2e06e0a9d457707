#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/data/trajectory.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"
#include "stereo_descriptor_vo/places/place_recognition.hpp"

namespace sdvo {

/// How well places were recognised, by the true poses.
struct PlaceErrors {
  int revisits = 0;     ///< key frames where the camera had been before: within 5 m and 30 degrees
  int recognised = 0;   ///< of these, those that a loop was accepted for
  int loops = 0;        ///< accepted
  int false_loops = 0;  ///< of these, those wrong by more than 1 m or 5 degrees, or to another sequence
  double worst_translation = 0.0, worst_rotation = 0.0;  ///< of any accepted loop, m and deg
  double ate_before = 0.0, ate_after = 0.0;              ///< m, rmse of all pairs after the best rigid alignment
};

/// Place recognition along the odometry of recordings. Each loop is followed by an optimisation of the graph.
class PlaceRun {
 public:
  explicit PlaceRun(const PlaceRecognitionOptions& options) : options_(options), recognition_(options) {}

  void process(const StereoFeatures& features, const OdometryResult& odometry);

  /// Begins another sequence, which was driven where no earlier one was. Poses and errors are of the last sequence.
  void startSequence();

  const PlaceRecognition& recognition() const { return recognition_; }

  /// Poses of all pairs in the final map. Each pair keeps its pose relative to the last key frame before it.
  Trajectory poses() const;

  PlaceErrors errors(const Trajectory& truth) const;

  /// Quantile of the time that a key frame took, without the optimisation, ms.
  double keyframeTime(double quantile) const;
  double longestOptimisation() const { return longest_optimisation_; }  ///< ms
  double cpuTime() const;                                               ///< ms a pair, mean, all included

  /// A CSV with a line for each key frame.
  void writeKeyframes(const std::string& path) const;

 private:
  struct Keyframe {
    int pair;  ///< number in its sequence
    PlaceReport report;
  };
  struct Pair {
    int keyframe;  ///< the last one, by its place in `keyframes_`; -1 before the first
    Eigen::Isometry3d T_odom_camera;
  };
  std::vector<Keyframe>::const_iterator ownKeyframes() const {
    return keyframes_.begin() + static_cast<std::ptrdiff_t>(first_keyframe_);
  }
  bool isRevisit(const Trajectory& truth, const Keyframe& keyframe) const;

  PlaceRecognitionOptions options_;
  PlaceRecognition recognition_;
  std::vector<Keyframe> keyframes_;
  std::vector<Pair> pairs_;
  double cpu_time_ = 0.0, longest_optimisation_ = 0.0;  ///< ms
  bool had_pose_ = false;
  std::size_t first_pair_ = 0, first_keyframe_ = 0;  ///< of the last sequence
};

}  // namespace sdvo
