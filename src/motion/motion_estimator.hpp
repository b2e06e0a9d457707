#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "motion_refinement.hpp"
#include "pose_problem.hpp"
#include "sample_consensus.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/options/visual_odometry_options.hpp"

namespace sdvo {

struct MotionEstimate {
  bool success = false;
  std::string reason;  ///< of a failure
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  /// Covariance of the left perturbation xi = (translation, rotation) in exp(xi) * T_current_reference, m and rad;
  /// -xi is the right one of T_reference_current.
  Matrix6d covariance = Matrix6d::Zero();
  std::vector<int> inliers;  ///< indices of the correspondences, ascending
  double rms = 0.0;          ///< of the inliers' residuals, px per coordinate
};

/// The indices of `first` that `second` lacks. Both ascend.
inline std::vector<int> without(const std::vector<int>& first, const std::vector<int>& second) {
  std::vector<int> rest;
  std::set_difference(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(rest));
  return rest;
}

/// Camera motion from 3-D to stereo correspondences with outliers: P3P sample consensus scored on the stereo
/// reprojection error, then robust refinement. Stateless: the seed is part of the options.
class MotionEstimator {
 public:
  explicit MotionEstimator(const MotionEstimatorOptions& options);

  /// `expected`, the predicted T_current_reference, is a second start of the refinement; the pose with the lower cost
  /// wins. `noise`: factor on the standard deviations that the options assume.
  MotionEstimate estimate(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
                          const std::optional<Eigen::Isometry3d>& expected = std::nullopt, double noise = 1.0) const;

 private:
  MotionEstimatorOptions options_;
};

}  // namespace sdvo
