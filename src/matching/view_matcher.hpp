#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "../motion/motion_estimator.hpp"
#include "../motion/pose_problem.hpp"
#include "../motion/rig_calibration.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// (u_left, v_left, u_right) of a pair's feature, px, without the rig's error. `shift`: correction of its position in
/// both images by an alignment, px.
Eigen::Vector3d measurementOf(const StereoFeatures& features, int feature, const RigCalibration& calibration,
                              const Eigen::Vector2d& shift = Eigen::Vector2d::Zero());

/// Measurements by a pair's features of the points that they were matched to.
std::vector<Correspondence> correspond(const DescribedPoints& reference, const StereoFeatures& features,
                                       const std::vector<FeatureMatch>& matches, const RigCalibration& calibration);

/// Matches of a pair with described points, and the motion from these points' frame to the pair.
struct ViewMatch {
  std::vector<FeatureMatch> matches;
  std::vector<Correspondence> correspondences;  ///< one for each match
  MotionEstimate motion;                        ///< its inliers are indices of matches
};

/// Matches a pair with described points by descriptors, then finds the pose that most matches agree on.
class ViewMatcher {
 public:
  explicit ViewMatcher(const MotionEstimatorOptions& motion, const FeatureMatcherOptions& matcher = {})
      : matcher_(matcher), estimator_(motion) {}

  /// With an expected pose the search is gated.
  ViewMatch match(const DescribedPoints& reference, const StereoFeatures& features, const RigCalibration& calibration,
                  const std::optional<Eigen::Isometry3d>& expected = std::nullopt) const;

 private:
  FeatureMatcher matcher_;
  MotionEstimator estimator_;
};

}  // namespace sdvo
