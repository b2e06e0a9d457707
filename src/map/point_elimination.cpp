#include "point_elimination.hpp"

#include <Eigen/Cholesky>
#include <cstddef>

#include "map_point.hpp"

namespace sdvo {
namespace {

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
    shape = RigCalibration::shape(camera, seen.measurement.x(), seen.measurement.y());
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
  Eigen::Matrix3d by_place;  ///< by P at constant rho
  Eigen::Matrix3d by_point;
  Vector6d disparity_by_pose;

  WindowJacobians(const WindowProjection& projection, const ObservedPoint& point, const WindowResidual& at,
                  const Eigen::Isometry3d& T) {
    const double rho = point.ray_and_inverse_depth.z(), iz = 1.0 / at.P.z();
    const double a = projection.camera.fx * iz * at.inverse_noise.x();
    const double b = projection.camera.fy * iz * at.inverse_noise.y();
    const double c = projection.camera.fx * projection.camera.baseline * iz * at.inverse_noise.z(), d = c * rho * iz;
    const double x = at.P.x() * iz, y = at.P.y() * iz;
    by_place << a, 0.0, -a * x, 0.0, b, -b * y, 0.0, 0.0, -d;
    const auto byDirection = [&](const auto& v) {
      return Eigen::Vector3d(a * (v.x() - x * v.z()), b * (v.y() - y * v.z()), -d * v.z());
    };
    by_point << byDirection(T.linear().col(0)), byDirection(T.linear().col(1)), byDirection(T.translation());
    by_point(2, 2) += c;
    disparity_by_pose << 0.0, 0.0, -rho * d, -d * at.P.y(), d * at.P.x(), 0.0;
  }
};

/// From columns of derivatives by P to those by the pose: a perturbation (t, w) of it moves P by rho t + w x P.
template <int kColumns>
void toPose(double rho, const Eigen::Vector3d& P, const Eigen::Matrix<double, 3, kColumns>& by_place,
            Eigen::Matrix<double, 6, kColumns>& by_pose) {
  by_pose.template topRows<3>() = rho * by_place;
  for (int k = 0; k < kColumns; ++k) by_pose.col(k).template tail<3>() = P.cross(by_place.col(k));
}

/// block -= a b^T. Column by column: so a compiler keeps `a` in registers.
template <class Block>
void subtractProduct(const Eigen::Matrix<double, 6, 3>& a, const Eigen::Matrix<double, 6, 3>& b, Block&& block) {
  for (int k = 0; k < 6; ++k) block.col(k) -= a.col(0) * b(k, 0) + a.col(1) * b(k, 1) + a.col(2) * b(k, 2);
}

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
  hessian.setZero(6 * poses + kCalibration, 6 * poses + kCalibration);
  gradient.setZero(6 * poses + kCalibration);
}

EliminatedPoint PoseEquations::add(const WindowProjection& projection, const ObservedPoint& point,
                                   const Linearisation& linearisation, PoseFactor* factors, double* squares) {
  constexpr double kLeastInformation = 1e-9;  // keeps H invertible if no observation constrains a direction
  const Eigen::Index calibration = hessian.rows() - kCalibration;
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
    hessian.bottomRightCorner<kCalibration, kCalibration>() +=
        at.inverse_noise.z() * at.shape.transpose() * weighted_shape;
    result.weight += w;
    result.disparity_residual += w * at.value.z();
    result.disparity_by_point += weighted.row(2).transpose();
    ++result.observations;
    if (seen.frame == 0) continue;
    PoseFactor& factor = factors[result.factors++];
    factor.pose = seen.frame - 1;
    const double rho = point.ray_and_inverse_depth.z();
    const Eigen::Matrix3d weighted_place = w * J.by_place.transpose();
    toPose<3>(rho, at.P, weighted_place.lazyProduct(J.by_point), factor.Y);
    toPose<1>(rho, at.P, weighted_place.lazyProduct(at.value), factor.gradient);
    Eigen::Matrix<double, 6, 3> by_both;
    toPose<3>(rho, at.P, weighted_place.lazyProduct(J.by_place), by_both);
    auto of_pose = hessian.block<6, 6>(6 * factor.pose, 6 * factor.pose);
    of_pose.leftCols<3>() += rho * by_both;
    for (int k = 3; k < 6; ++k) of_pose.block<1, 3>(k, 3) += at.P.cross(by_both.row(k)).transpose();
    hessian.block<kCalibration, 6>(calibration, 6 * factor.pose).noalias() +=
        weighted_shape.transpose() * J.disparity_by_pose.transpose();
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
    gradient.segment<6>(6 * factor.pose) += factor.gradient;
    hessian.block<kCalibration, 6>(calibration, 6 * factor.pose).noalias() -=
        result.by_calibration * factor.Y.transpose();
    for (int other = 0; other <= k; ++other)
      subtractProduct(factor.Y, factors[other].Y, hessian.block<6, 6>(6 * factor.pose, 6 * factors[other].pose));
  }
  hessian.bottomRightCorner<kCalibration, kCalibration>() -= result.by_calibration * result.by_calibration.transpose();
  gradient.tail<kCalibration>() += result.calibration_gradient;
  return result;
}

}  // namespace sdvo
