#include "point_elimination.hpp"

#include <Eigen/Cholesky>
#include <cstddef>

#include "stereo_descriptor_vo/map/map_point.hpp"

namespace sdvo {
namespace {

using PoseJacobian = Eigen::Matrix<double, 3, 6>;

/// Measurement minus prediction (as by predictObservation()) of a point in one camera, divided by the noise.
struct WindowResidual {
  Eigen::Vector3d P;  ///< scaled point in the camera's frame
  Eigen::Vector3d inverse_noise;
  Eigen::Vector3d value;
  RigCalibration::RowVector shape;
  double square;

  WindowResidual(const WindowProjection& projection, const ObservedPoint& point, const WindowObservation& seen) {
    const StereoCamera& camera = projection.camera;
    const Eigen::Isometry3d& T = point.T_camera_anchor[seen.frame];
    const Eigen::Vector3d& ray = point.ray_and_inverse_depth;
    P = T.linear().col(0) * ray.x() + T.linear().col(1) * ray.y() + T.linear().col(2) + T.translation() * ray.z();
    shape = RigCalibration::shape(camera, seen.measurement.x());
    inverse_noise << 1.0 / seen.sigma, 1.0 / seen.sigma, point.inverse_disparity_sigma;
    const double iz = 1.0 / P.z();
    const Eigen::Vector3d predicted(
        camera.cx + camera.fx * P.x() * iz, camera.cy + camera.fy * P.y() * iz,
        camera.fx * camera.baseline * ray.z() * iz + shape.dot(projection.calibration.value));
    value = inverse_noise.cwiseProduct(seen.measurement - predicted);
    square = isInFront() ? value.squaredNorm() : kBehindSquare;
  }
  bool isInFront() const { return P.z() >= kNearestScaled; }
};

/// Derivatives of the prediction, divided by the noise.
struct WindowJacobians {
  Eigen::Matrix3d by_point;
  PoseJacobian by_pose;  ///< by the left perturbation

  WindowJacobians(const WindowProjection& projection, const ObservedPoint& point, const WindowResidual& at,
                  const Eigen::Isometry3d& T) {
    const double rho = point.ray_and_inverse_depth.z(), iz = 1.0 / at.P.z();
    const double fb = projection.camera.fx * projection.camera.baseline;
    const double a = projection.camera.fx * iz * at.inverse_noise.x();
    const double b = projection.camera.fy * iz * at.inverse_noise.y();
    const double c = fb * iz * at.inverse_noise.z(), d = c * rho * iz;
    const double x = at.P.x() * iz, y = at.P.y() * iz;
    // Rows of the derivative by P at constant rho: (a, 0, -a x), (0, b, -b y), (0, 0, -d). A perturbation (t, w) of the
    // pose moves P by rho t + w x P.
    const auto byDirection = [&](const auto& v) {
      return Eigen::Vector3d(a * (v.x() - x * v.z()), b * (v.y() - y * v.z()), -d * v.z());
    };
    by_point << byDirection(T.linear().col(0)), byDirection(T.linear().col(1)), byDirection(T.translation());
    by_point(2, 2) += c;
    by_pose << rho * a, 0.0, -rho * a * x, -a * x * at.P.y(), a * (at.P.z() + x * at.P.x()), -a * at.P.y(),  //
        0.0, rho * b, -rho * b * y, -b * (at.P.z() + y * at.P.y()), b * y * at.P.x(), b * at.P.x(),          //
        0.0, 0.0, -rho * d, -d * at.P.y(), d * at.P.x(), 0.0;
  }
};

}  // namespace

void squareResiduals(const WindowProjection& projection, const ObservedPoint& point, double* squares) {
  for (int i = 0; i < point.count; ++i) squares[i] = WindowResidual(projection, point, point.observations[i]).square;
}

void movePoints(const std::vector<EliminatedPoint>& points, const std::vector<PoseFactor>& factors,
                const Eigen::VectorXd& pose_steps, const RigCalibration::Vector& calibration_step,
                std::vector<Eigen::Vector3d>& ray_and_inverse_depth) {
  const PoseFactor* factor = factors.data();
  for (std::size_t p = 0; p < points.size(); ++p) {
    Eigen::Vector3d rest = points[p].gradient - points[p].by_calibration.transpose() * calibration_step;
    for (const PoseFactor* end = factor + points[p].factors; factor != end; ++factor)
      rest.noalias() -= factor->Y.transpose() * pose_steps.segment<6>(6 * factor->pose);
    ray_and_inverse_depth[p].noalias() += points[p].R.transpose() * rest;
  }
}

void PoseEquations::setZero(int poses) {
  hessian_.setZero(6 * poses + kCalibration, 6 * poses + kCalibration);
  gradient_.setZero(6 * poses + kCalibration);
}

EliminatedPoint PoseEquations::add(const WindowProjection& projection, const ObservedPoint& point,
                                   const Linearisation& linearisation, PoseFactor* factors, double* squares) {
  constexpr double kLeastInformation = 1e-9;  // keeps H invertible if no observation constrains a direction
  const Eigen::Index calibration = hessian_.rows() - kCalibration;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  EliminatedPoint result;
  result.by_calibration.setZero();
  result.calibration_gradient.setZero();
  result.disparity_by_point.setZero();
  result.weight = result.disparity_residual = 0.0;
  result.observations = result.factors = 0;
  for (int i = 0; i < point.count; ++i) {
    const WindowObservation& seen = point.observations[i];
    const WindowResidual at(projection, point, seen);
    squares[i] = at.square;
    if (!at.isInFront()) continue;
    const double w = linearisation.bend / (linearisation.bend + at.square);
    const WindowJacobians J(projection, point, at, point.T_camera_anchor[seen.frame]);
    const RigCalibration::RowVector weighted_shape = w * at.inverse_noise.z() * at.shape;  // changes disparities alone
    const Eigen::Matrix3d weighted = w * J.by_point;
    H.noalias() += weighted.transpose() * J.by_point;
    g.noalias() += weighted.transpose() * at.value;
    result.by_calibration.noalias() += weighted_shape.transpose() * J.by_point.row(2);
    result.calibration_gradient += weighted_shape.transpose() * at.value.z();
    hessian_.bottomRightCorner<kCalibration, kCalibration>() +=
        at.inverse_noise.z() * at.shape.transpose() * weighted_shape;
    result.weight += w;
    result.disparity_residual += w * at.value.z();
    result.disparity_by_point += weighted.row(2).transpose();
    ++result.observations;
    if (seen.frame == 0) continue;
    PoseFactor& factor = factors[result.factors++];
    factor.pose = seen.frame - 1;
    const PoseJacobian weighted_pose = w * J.by_pose;
    factor.Y.noalias() = weighted_pose.transpose() * J.by_point;
    factor.gradient.noalias() = weighted_pose.transpose() * at.value;
    hessian_.block<6, 6>(6 * factor.pose, 6 * factor.pose).noalias() += weighted_pose.transpose() * J.by_pose;
    hessian_.block<kCalibration, 6>(calibration, 6 * factor.pose).noalias() +=
        weighted_shape.transpose() * J.by_pose.row(2);
  }

  const Eigen::Vector3d unit(1.0, 1.0, projection.camera.baseline * projection.camera.baseline);
  H.diagonal() = H.diagonal() * (1.0 + linearisation.damping) + kLeastInformation * unit;
  const Eigen::LLT<Eigen::Matrix3d> root(H);
  result.R = root.matrixL().solve(Eigen::Matrix3d::Identity());
  result.gradient = result.R * g;
  result.by_calibration = (result.by_calibration * result.R.transpose()).eval();
  result.calibration_gradient -= result.by_calibration * result.gradient;
  for (int k = 0; k < result.factors; ++k) {
    PoseFactor& factor = factors[k];
    factor.Y = (factor.Y * result.R.transpose()).eval();
    factor.gradient.noalias() -= factor.Y * result.gradient;
    gradient_.segment<6>(6 * factor.pose) += factor.gradient;
    hessian_.block<kCalibration, 6>(calibration, 6 * factor.pose).noalias() -=
        result.by_calibration * factor.Y.transpose();
    for (int other = 0; other <= k; ++other)
      hessian_.block<6, 6>(6 * factor.pose, 6 * factors[other].pose).noalias() -=
          factor.Y * factors[other].Y.transpose();
  }
  hessian_.bottomRightCorner<kCalibration, kCalibration>() -= result.by_calibration * result.by_calibration.transpose();
  gradient_.tail<kCalibration>() += result.calibration_gradient;
  return result;
}

}  // namespace sdvo
