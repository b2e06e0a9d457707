#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/described_points.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/motion/motion_estimator.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// Described points in a pair, and from where it sees them.
struct ViewMatch {
  std::vector<FeatureMatch> matches;
  std::vector<Correspondence> correspondences;  ///< one for each match
  MotionEstimate motion;                        ///< its inliers are indices of matches
};

/// Matches a pair with described points by descriptors, then finds the pose that most matches agree on.
class ViewMatcher {
 public:
  ViewMatcher(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion)
      : matcher_(matcher), estimator_(motion) {}

  /// With an expected pose the search is gated, if the options say so.
  ViewMatch match(const DescribedPoints& reference, const StereoFeatures& features, const RigCalibration& calibration,
                  const std::optional<Eigen::Isometry3d>& expected = std::nullopt) const;

 private:
  FeatureMatcher matcher_;
  MotionEstimator estimator_;
};

}  // namespace sdvo
