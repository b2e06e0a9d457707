#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "stereo_descriptor_vo/options.hpp"
#include "stereo_descriptor_vo/se3.hpp"
#include "stereo_descriptor_vo/stereo_camera.hpp"

namespace sdvo {

struct MotionEstimatorOptions {
  double inlier_threshold = 2.0;
  double confidence = 0.999;
  int min_iterations = 30;
  int max_iterations = 500;
  int seed = 1;
  std::string kernel = "cauchy";
  double kernel_scale = 1.0;
  int refinement_iterations = 20;
  int min_inliers = 12;

  void describe(OptionList& list) {
    list.add("inlier_threshold", inlier_threshold, {0.1, 20.0}, "px",
             "largest length of the stereo reprojection error (u_left, v_left, u_right) of an inlier");
    list.add("confidence", confidence, {0.5, 0.999999}, "", "probability that one sample without outliers is drawn");
    list.add("min_iterations", min_iterations, {1, 100000}, "", "samples drawn at least");
    list.add("max_iterations", max_iterations, {1, 100000}, "", "samples drawn at most");
    list.add("seed", seed, {0, 1000000000}, "", "of the random samples; equal seeds give equal results");
    list.add("kernel", kernel, {"cauchy", "huber"}, "robust kernel of the refinement");
    list.add("kernel_scale", kernel_scale, {0.05, 20.0}, "px", "residual at which the kernel starts to bend");
    list.add("refinement_iterations", refinement_iterations, {1, 200}, "", "Gauss-Newton steps at most");
    list.add("min_inliers", min_inliers, {4, 10000}, "", "fewer are no motion");
  }
};

/// One point seen from two camera positions.
struct Correspondence {
  Eigen::Vector3d point;        ///< in the reference camera's left optical frame, m
  Eigen::Vector3d measurement;  ///< (u_left, v_left, u_right) in the current pair, px
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

/// Camera motion from 3-D to stereo correspondences with outliers: P3P sample consensus scored on the stereo reprojection
/// error, then robust refinement. Stateless: the seed is part of the options.
class MotionEstimator {
 public:
  explicit MotionEstimator(const MotionEstimatorOptions& options);

  MotionEstimate estimate(const StereoCamera& camera, const std::vector<Correspondence>& correspondences) const;

 private:
  MotionEstimatorOptions options_;
};

/// Residual (measurement - projection, px) of a correspondence under T_current_reference; nothing when the point is not in
/// front of the camera.
std::optional<Eigen::Vector3d> reprojectionResidual(const StereoCamera& camera,
                                                    const Eigen::Isometry3d& T_current_reference,
                                                    const Correspondence& correspondence);

/// Derivative of the projection of exp(xi) * T_current_reference * point by xi at zero, (u_left, v_left, u_right) rows.
Eigen::Matrix<double, 3, 6> motionJacobian(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                           const Eigen::Vector3d& point);

}  // namespace sdvo
