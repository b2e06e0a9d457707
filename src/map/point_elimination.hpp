#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "../motion/rig_calibration.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "window_optimizer.hpp"

namespace sdvo {

constexpr int kCalibration = RigCalibration::kParameters;

/// Camera and calibration, which all observations of a window share.
struct WindowProjection {
  StereoCamera camera;
  RigCalibration calibration;
};

/// A point of a window with all its observations; it has at least one.
struct ObservedPoint {
  Eigen::Vector3d ray_and_inverse_depth;  ///< in its anchor
  const WindowObservation* observations;  ///< in the order of their frames
  int count;
  double inverse_disparity_sigma;            ///< of each observation, 1/px
  const Eigen::Isometry3d* T_camera_anchor;  ///< of each frame; the first one, 0, is held fixed
};

/// Squared residual of a point that is not in front of the camera: that of a gross outlier.
constexpr double kBehindSquare = 1e4;

/// Squares of the observations' normalised residuals; kBehindSquare where the point is not in front of the camera.
void squareResiduals(const WindowProjection& projection, const ObservedPoint& point, double* squares);

/// Rows of a factor: six, and the first two again, so that they fill registers.
constexpr int kFactorRows = 8;
using FactorColumn = Eigen::Matrix<double, kFactorRows, 1>;

/// An observation's entries in the normal equations, by its pose (left perturbation: m, rad).
struct PoseFactor {
  Eigen::Matrix<double, kFactorRows, 3> Y;  ///< J_pose^T W J_point R^T: products of these are the Schur complement
  FactorColumn gradient;                    ///< its share of the reduced gradient
  int pose;                                 ///< among the poses that may move, from zero on
};

/// A point's 3x3 normal equations H x = g, factored as H = L L^T with R = L^-1. `by_calibration` is the block of the
/// calibration and the point times R^T.
struct EliminatedPoint {
  Eigen::Matrix3d R;
  Eigen::Vector3d gradient;  ///< R g
  Eigen::Matrix<double, kCalibration, 3> by_calibration;
  RigCalibration::Vector calibration_gradient;  ///< the point's share of the reduced gradient
  int factors;                                  ///< observations that count, from poses that may move
  int observations;                             ///< observations that count: the point is in front of the camera

  // Weighted sums over `observations`.
  double weight;
  double disparity_residual;           ///< normalised
  Eigen::Vector3d disparity_by_point;  ///< derivatives of the predicted disparities, normalised
};

/// A residual's square s costs bend * log(1 + s / bend) and weighs 1 / (1 + s / bend) in the normal equations.
struct Linearisation {
  double bend;           ///< square of the kernel's scale
  double damping = 0.0;  ///< fraction of its diagonal that is added to a point's H
};

/// Back-substitution: moves points (ray and inverse depth) to their optimum after a step of poses and calibration. The
/// step has six numbers (m, rad) for each pose that may move, the calibration's is in px. `factors`: sorted by point.
void movePoints(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                const Eigen::VectorXd& pose_steps, const RigCalibration::Vector& calibration_step,
                std::vector<Eigen::Vector3d>& ray_and_inverse_depth);

/// For each point: `by` times its share of the reduced gradient, in the first six rows.
void sumGradients(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                  const Eigen::Matrix<double, 6, Eigen::Dynamic>& by, std::vector<FactorColumn>& sums);

/// Reduced normal equations of all poses of a window but the first, and of the rig's calibration.
class PoseEquations {
 public:
  void setZero(int poses);

  /// Adds a point's observations with the point eliminated (Schur complement). Writes a factor for each observation
  /// from a pose that may move, and the same squares as squareResiduals(). Observations are in the order of their
  /// frames.
  EliminatedPoint add(const WindowProjection& projection, const ObservedPoint& point,
                      const Linearisation& linearisation, PoseFactor* factors, double* squares);

  /// The lower triangle of the matrix: the poses by their left perturbations (m, rad), then the calibration.
  void writeHessian(Eigen::MatrixXd& hessian) const;
  const Eigen::VectorXd& gradient() const { return gradient_; }  ///< in the same order

 private:
  friend struct AddPoint;
  /// Column by column, contiguous.
  struct PoseBlock {
    double values[6 * 6];
  };
  /// The same; rows beyond the calibration's fill a register of doubles.
  struct CalibrationBlock {
    static constexpr int kRows = 4;
    static_assert(kCalibration <= kRows, "a column is one register");
    double values[6 * kRows];
  };

  double* H_xx(int row, int column) { return H_xx_[static_cast<std::size_t>(row * (row + 1) / 2 + column)].values; }

  std::vector<PoseBlock> H_xx_;         ///< lower triangle, row by row
  std::vector<CalibrationBlock> H_cx_;  ///< calibration and each pose
  RigCalibration::Matrix H_cc_;
  Eigen::VectorXd gradient_;
};

}  // namespace sdvo
