#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "../../src/motion/motion_estimator.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// What is known of how a patch changed between two pairs: nothing, or what the motion and the point's depth say.
enum class PatchWarp { kNone, kByDepth };

/// The motion refined on those inlier matches whose grey patches could be aligned, as the package's odometry does; as
/// it is when they are too few. `reference` and `current` carry the patches of the matched rows.
Eigen::Isometry3d alignedMotion(const MotionEstimatorOptions& options, const StereoFeatures& reference,
                                const StereoFeatures& current, const std::vector<FeatureMatch>& inliers, PatchWarp warp,
                                const Eigen::Isometry3d& T_current_reference);

}  // namespace sdvo
