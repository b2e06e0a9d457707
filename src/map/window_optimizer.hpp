#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "../motion/noise.hpp"
#include "../motion/rig_calibration.hpp"
#include "floor.hpp"
#include "map_point.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"

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
  std::vector<WindowObservation> observations;  ///< sorted by point, then by frame
  RigCalibration calibration;
  CalibrationBelief calibration_prior;
  std::optional<Floor> floor;  ///< constrains the base of every pose but the first
};

struct WindowOptimizerOptions {
  NoiseOptions noise = {};
  int iterations = 1;         ///< most accepted Levenberg-Marquardt steps: each new pair adjusts the window again
  double kernel_scale = 1.0;  ///< sigma: normalised residual that has half the weight
};

/// Results besides the window's new values.
struct WindowSolution {
  bool success = false;
  int iterations = 0;                   ///< accepted steps
  Eigen::MatrixXd pose_covariance;      ///< of the left perturbations of the poses asked for, 6 rows each, m and rad
  Eigen::MatrixXd pose_by_calibration;  ///< derivatives of these perturbations by the calibration, m/px and rad/px
  RigCalibration::Matrix calibration_information;  ///< of this window alone, the prior excluded, 1/px^2
  /// Variance, px^2, of the error that all disparities of one point share. It is a median over the points whose
  /// position comes mostly from motion; none if these are too few. Noise can make it negative.
  std::optional<double> common_disparity_square;
  std::vector<double> squares;  ///< of each observation's normalised residual
};

/// Bundle adjustment of windows: poses, points and the rig's calibration, by Levenberg-Marquardt with the points
/// eliminated first (Schur complement). Deterministic: windows share its memory, some megabytes, and nothing else.
class WindowOptimizer {
 public:
  explicit WindowOptimizer(const WindowOptimizerOptions& options);
  WindowOptimizer(WindowOptimizer&&) noexcept;
  WindowOptimizer& operator=(WindowOptimizer&&) noexcept;
  ~WindowOptimizer();

  /// The result is valid until the next call. `covariance_of`: poses whose covariance is needed, not the first one.
  /// Each costs six columns to solve.
  const WindowSolution& optimize(Window& window, const std::vector<int>& covariance_of);

 private:
  class Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace sdvo
