#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/motion/motion_refinement.hpp"
#include "stereo_descriptor_vo/motion/pose_problem.hpp"
#include "stereo_descriptor_vo/motion/sample_consensus.hpp"

namespace sdvo {

struct MotionEstimatorOptions : SampleConsensusOptions, MotionRefinementOptions {
  int min_inliers = 12;

  void describe(OptionList& list) {
    SampleConsensusOptions::describe(list);
    list.add("min_inliers", min_inliers, {4, 10000}, "", "fewer are no motion");
  }

  /// For measurements with this noise.
  void assume(const NoiseOptions& noise) { inlier_threshold = noise.inlierGate(), kernel_scale = noise.length(); }

  /// With the thresholds multiplied by `noise`.
  MotionEstimatorOptions scaled(double noise) const {
    MotionEstimatorOptions options = *this;
    options.inlier_threshold *= noise, options.kernel_scale *= noise;
    return options;
  }
};

struct MotionEstimate {
  bool success = false;
  std::string reason;  ///< of a failure
  Eigen::Isometry3d T_current_reference = Eigen::Isometry3d::Identity();
  /// Covariance of the left perturbation xi = (translation, rotation) in exp(xi) * T_current_reference, m and rad.
  Matrix6d covariance = Matrix6d::Zero();
  std::vector<int> inliers;  ///< indices of the correspondences, ascending
  double rms = 0.0;          ///< of the inliers' residuals, px per coordinate
  int iterations = 0;        ///< samples drawn
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
