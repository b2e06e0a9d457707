#include "row_readout.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "../motion/noise.hpp"
#include "../motion/pose_problem.hpp"

namespace sdvo {

void RowReadout::add(const StereoFeatures& features, const OdometryResult& result) {
  if (!result.has_motion || result.inliers < kFewestMeasured || !(result.dt > 0.0)) return;
  const StereoCamera& camera = features.camera;
  const Eigen::Isometry3d T_current_previous = result.T_previous_current.inverse();
  // The points' positions contain the shift that belongs to the mean velocity of the last pairs.
  const Vector6d change = logSE3(result.T_previous_current) / result.dt - usual_velocity_;
  usual_velocity_ += (1.0 - kUsualMemory) * change;
  // The pose is fitted for each pair and eliminated: only shifts that no motion explains count.
  using Row = Eigen::Matrix<double, 6, 1>;
  Matrix6d square = Matrix6d::Zero();
  Row by_shift = Row::Zero(), by_rest = Row::Zero();
  double shift_square = 0.0, product = 0.0;
  for (const FeatureFlow& flow : result.flow) {
    const int i = flow.current;
    const Correspondence point{camera.backProject(flow.u_previous, flow.v_previous, flow.disparity_previous),
                               {features.u[i], features.v[i], features.u[i] - features.disparity[i]}};
    const auto residual = reprojectionResidual(camera, T_current_previous, point);
    // The adjustment's outliers are used, too, because it rejects points with a large shift.
    if (!residual || residual->norm() > NoiseOptions().inlierGate()) continue;
    const Eigen::Matrix<double, 2, 6> jacobian = motionJacobian(camera, T_current_previous, point.point).topRows<2>();
    // A static point moves in the camera's frame by the inverse of the camera's motion.
    const Eigen::Vector2d shift = (point.measurement.y() - camera.cy) / camera.height * (jacobian * -change);
    const Eigen::Vector2d rest = residual->head<2>();
    square += jacobian.transpose() * jacobian;
    by_shift += jacobian.transpose() * shift;
    by_rest += jacobian.transpose() * rest;
    shift_square += shift.squaredNorm();
    product += shift.dot(rest);
  }
  const Eigen::LDLT<Matrix6d> solver(square);
  const double information = shift_square - by_shift.dot(solver.solve(by_shift));
  product -= by_shift.dot(solver.solve(by_rest));
  if (!std::isfinite(information) || !std::isfinite(product)) return;
  constexpr double kMemory = RowDelay::kMemory, kForget = kMemory * kMemory;
  information_ = kMemory * information_ + information;
  product_ = kMemory * product_ + product;
  information_square_ = kForget * information_square_ + information * information;
  mixed_ = kForget * mixed_ + information * product;
  product_square_ = kForget * product_square_ + product * product;
  pairs_ = kMemory * pairs_ + 1.0;
}

std::optional<RowReadout::Estimate> RowReadout::estimate() const {
  if (pairs_ < kFewestMeasured || !(information_ > 0.0)) return std::nullopt;
  const double value = product_ / information_;
  const double spread = product_square_ - 2.0 * value * mixed_ + value * value * information_square_;
  const Estimate estimate{value, std::sqrt(std::max(spread, 0.0)) / information_};
  if (!(estimate.sigma < RowDelay::kFail)) return std::nullopt;
  return estimate;
}

}  // namespace sdvo
