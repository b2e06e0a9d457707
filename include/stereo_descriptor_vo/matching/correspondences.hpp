#pragma once

#include <Eigen/Core>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/described_points.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/motion/pose_problem.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// (u_left, v_left, u_right) of a pair's feature, px, without the rig's error; its position in the left image is known
/// better by `shift`, px.
Eigen::Vector3d measurementOf(const StereoFeatures& features, int row, const RigCalibration& calibration,
                              const Eigen::Vector2d& shift = Eigen::Vector2d::Zero());

/// What a pair's features measure of the points that they were matched to.
std::vector<Correspondence> correspond(const DescribedPoints& reference, const StereoFeatures& features,
                                       const std::vector<FeatureMatch>& matches, const RigCalibration& calibration);

}  // namespace sdvo
