#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/map/floor.hpp"
#include "stereo_descriptor_vo/map/map_point.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// An observation by indices of the window's points and poses.
struct WindowObservation : Observation {
  int point, frame;
};

/// Several pairs and the points they share.
struct Window {
  StereoCamera camera;
  std::vector<Eigen::Isometry3d> T_camera_origin;  ///< the first one is held fixed
  std::vector<AnchoredPoint> points;
  std::vector<WindowObservation> observations;  ///< sorted by point
  RigCalibration calibration;
  CalibrationBelief calibration_prior;
  std::optional<Floor> floor;  ///< on which the base of every pose but the first is held
};

struct WindowOptimizerOptions {
  int iterations = 1;         ///< Levenberg-Marquardt steps at most, for each pair; refused ones do not count
  double kernel_scale = 1.0;  ///< sigma: normalised residual at which the Cauchy kernel bends
  NoiseOptions noise;
};

/// What is known after the optimisation, besides the window's new values.
struct WindowSolution {
  bool success = false;
  int iterations = 0;                   ///< accepted steps
  Eigen::MatrixXd pose_covariance;      ///< of the left perturbations of the poses asked for, 6 rows each, m and rad
  Eigen::MatrixXd pose_by_calibration;  ///< the same perturbations by the calibration, 1/px
  RigCalibration::Matrix calibration_information;  ///< of this window alone, the prior excluded, 1/px^2
  /// Variance, px^2, of the error that all disparities of one point share. It comes from the median of its squares over
  /// the points, and is below zero by chance. None where too few points are known better from their motion than from
  /// their disparities.
  std::optional<double> common_disparity_square;
  std::vector<double> squares;  ///< of each observation's normalised residual
};

/// Bundle adjustment of windows: poses, points and the rig's calibration, by Levenberg-Marquardt with the points
/// eliminated first (Schur complement). Deterministic: only its memory, some megabytes, goes from one window to the
/// next.
class WindowOptimizer {
 public:
  explicit WindowOptimizer(const WindowOptimizerOptions& options);
  WindowOptimizer(WindowOptimizer&&) noexcept;
  WindowOptimizer& operator=(WindowOptimizer&&) noexcept;
  ~WindowOptimizer();

  /// The solution is there until the next one. `covariance_of`: poses whose covariance is asked for, not the first one;
  /// six columns are solved for each.
  const WindowSolution& optimize(Window& window, const std::vector<int>& covariance_of);
  /// With the covariance of all poses but the first.
  const WindowSolution& optimize(Window& window);

  const WindowOptimizerOptions& options() const { return options_; }

 private:
  struct Memory;
  WindowOptimizerOptions options_;
  std::unique_ptr<Memory> memory_;
};

}  // namespace sdvo
