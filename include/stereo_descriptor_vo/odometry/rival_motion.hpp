#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"

namespace sdvo {

/// The motion that some of the correspondences agree on: those that stood still so far, or the outliers of another
/// motion, among which something that moves by itself may be. Its inliers are indices of all correspondences.
MotionEstimate estimateAmong(const MotionEstimator& estimator, const StereoCamera& camera,
                             const std::vector<Correspondence>& correspondences, const std::vector<int>& subset);

/// Whether two motions T_current_reference mean the same: they project most of the given points within so many px.
bool agree(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
           const std::vector<int>& points, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double within = 1.0);

}  // namespace sdvo
