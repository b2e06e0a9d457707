#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// Mutual nearest neighbours on descriptors alone: no gating, no limit of the distance.
std::vector<FeatureMatch> matchByDescriptor(const StereoFeatures& reference, const StereoFeatures& current);

/// Number of matches whose 3-D point of the reference pair, moved by T_current_reference, reprojects within
/// `tolerance` px of the matched key point in the left image.
int countCorrect(const StereoFeatures& reference, const StereoFeatures& current,
                 const std::vector<FeatureMatch>& matches, const Eigen::Isometry3d& T_current_reference,
                 double tolerance);

}  // namespace sdvo
