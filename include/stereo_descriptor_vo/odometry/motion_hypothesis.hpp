#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"
#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"
#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"
#include "stereo_descriptor_vo/odometry/rig_calibration.hpp"

namespace sdvo {

/// The input of a search for a pair's motion. The references must outlive it.
struct MotionScene {
  const LocalMap& map;
  const RigCalibration& calibration;
  const StereoFeatures& features;
  std::optional<Eigen::Isometry3d> T_current_reference;  ///< as expected, since the map's newest pair
  std::optional<Vector6d> velocity;                      ///< of the camera before, m/s and rad/s
  bool contested = false;                                ///< a moment ago something else moved in view
  double velocity_age = 0.0;                             ///< of that at the map's newest pair, s
  std::optional<Eigen::Isometry3d> guess;                ///< T_current_reference as something else than images has it
};

/// One answer to where a pair is, and what speaks for it.
struct MotionHypothesis {
  PoseEvidence evidence;
  PoseVerdict verdict;
  MotionEstimate motion;                       ///< since the map's newest pair
  std::optional<Eigen::Isometry3d> rival;      ///< T_current_reference of a hypothesis that could not be rejected
  bool contested = false;                      ///< by a motion of something else in view
  std::shared_ptr<const LocalMap::View> view;  ///< of the map; one for all hypotheses of a pair
  std::vector<FeatureMatch> matches;           ///< rows of the view to rows of the pair
  std::vector<Correspondence> correspondences;
  std::vector<LocalMap::Sighting> sightings;   ///< of the motion's inliers
  double match_time = 0.0, motion_time = 0.0;  ///< s

  /// Whether a match is one of a point that stood still in several pairs.
  bool isLasting(int match) const;

  /// Rows of the pair that the inliers matched, but for the rejected ones.
  std::vector<int> inlierRows(const std::vector<int>& rejected = {}) const;

  /// How many of those are of lasting points.
  int lastingInliers(const std::vector<int>& rejected = {}) const;
};

/// Share of an 8x4 grid's cells over the image that hold one of the pair's rows.
double coverage(const StereoFeatures& features, const std::vector<int>& rows);

}  // namespace sdvo
