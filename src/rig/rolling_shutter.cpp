#include "rolling_shutter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "../motion/noise.hpp"
#include "../motion/pose_problem.hpp"

namespace sdvo {
namespace {

/// Kalman gain of the rate by rows, for an expected rate with this variance, rad^2/s^2.
Eigen::Matrix3d gainOfRows(const RateByRows& rate, double variance) {
  constexpr double kWithMap = 2.0;  // factor on the pair's own variance (chosen): the map errs as much
  const Eigen::Matrix3d expected = variance * Eigen::Matrix3d::Identity();
  return expected * (expected + kWithMap * rate.covariance).inverse();
}

}  // namespace

std::optional<LeftResidual> leftResidual(const StereoCamera& camera, const Eigen::Isometry3d& T_current_reference,
                                         const Eigen::Vector3d& point, const Eigen::Vector2d& measured) {
  const Eigen::Vector3d here = T_current_reference * point;
  if (!(here.z() > camera.nearestDepth())) return std::nullopt;
  return LeftResidual{motionJacobian(camera, T_current_reference, point).topRows<2>(),
                      measured - camera.project(here).head<2>()};
}

StereoFeatures RollingShutter::asGlobal(const RolledPair& pair) {
  const StereoCamera& camera = pair.features.camera;
  StereoFeatures result = pair.features;
  for (int i = 0; i < result.count(); ++i) {
    const Eigen::Isometry3d T_stamp_row = expSE3(pair.readout * rowTime(camera, pair.features.v[i]) * pair.velocity);
    const Eigen::Vector3d point = T_stamp_row * pair.features.point(i);
    if (!(point.z() > camera.nearestDepth())) continue;
    const Eigen::Vector3d pixel = camera.project(point);
    result.u[i] = static_cast<float>(pixel.x());
    result.v[i] = static_cast<float>(pixel.y());
    result.disparity[i] = static_cast<float>(camera.disparity(point.z()));
  }
  return result;
}

bool RollingShutter::isNegligible(const StereoCamera& camera, const Vector6d& difference) const {
  constexpr double kNegligible = 0.01;  // px (chosen): a tenth of an aligned position's noise
  return 0.5 * std::abs(readout_) * camera.fx * difference.tail<3>().norm() < kNegligible;
}

/// Least squares over the errors of pose and rate. A row that is taken t s after the stamp was moved by t * rate, so an
/// error of the rate turns its pose by -t * error.
std::optional<RateByRows> RollingShutter::rateByRows(const RolledPair& pair, const MotionHypothesis& found) const {
  using Matrix = Eigen::Matrix<double, 9, 9>;
  using Vector = Eigen::Matrix<double, 9, 1>;
  constexpr int kReweightings = 3;  // passes (chosen), each with the weights of the one before
  const StereoCamera& camera = pair.features.camera;
  const Eigen::Isometry3d& T = found.motion.T_current_reference;
  Vector error = Vector::Zero();
  Matrix information;
  for (int pass = 0; pass < kReweightings; ++pass) {
    information.setZero();
    Vector product = Vector::Zero();
    for (std::size_t k = 0; k < found.sightings.size(); ++k) {
      const LocalMap::Sighting& sighting = found.sightings[k];
      const FeatureMatch& match = found.matches[found.motion.inliers[k]];
      const Eigen::Vector3d& point = found.view->points.positions[match.reference];
      const auto residual = leftResidual(camera, T, point, sighting.measurement.head<2>());
      if (!residual) continue;
      const double moved_by = pair.readout * rowTime(camera, pair.features.v[match.current]);  // s
      Eigen::Matrix<double, 2, 9> jacobian;
      jacobian << residual->by_pose, -moved_by * residual->by_pose.rightCols<3>();
      const double square = (residual->value - jacobian * error).squaredNorm();
      const double weight = 1.0 / (sighting.sigma * sighting.sigma + square);  // Cauchy's kernel
      information += weight * jacobian.transpose() * jacobian;
      product += weight * jacobian.transpose() * residual->value;
    }
    error = information.ldlt().solve(product);
  }
  const RateByRows rate{pair.velocity.tail<3>() + error.tail<3>(),
                        Matrix(information.inverse()).bottomRightCorner<3, 3>(),
                        information.topLeftCorner<6, 6>().ldlt().solve(information.topRightCorner<6, 3>())};
  const bool is_constrained = rate.value.allFinite() && rate.covariance.allFinite() &&
                              rate.motion_by_rate.allFinite() && rate.covariance.diagonal().minCoeff() > 0.0;
  return is_constrained ? std::optional(rate) : std::nullopt;
}

double RollingShutter::varianceAt(const RolledPair& pair) const {
  return 7.0 / 24.0 * acceleration_square_ * pair.dt;
}

Vector6d RollingShutter::velocityAt(const RolledPair& pair) const {
  Vector6d velocity = pair.mean_velocity.value_or(Vector6d::Zero());
  if (pair.mean_velocity && pair.mean_velocity_before) velocity = velocityAfter(*pair.mean_velocity_before, velocity);
  if (!pair.rate_by_rows) return velocity;
  const Eigen::Matrix3d gain = pair.mean_velocity ? gainOfRows(*pair.rate_by_rows, varianceAt(pair))
                                                  : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  velocity.tail<3>() += gain * (pair.rate_by_rows->value - velocity.tail<3>());
  return velocity;
}

Vector6d RollingShutter::velocityBetween(const RolledPair& pair, const Vector6d& next) const {
  return pair.mean_velocity ? Vector6d(0.5 * (*pair.mean_velocity + next)) : next;
}

Matrix6d RollingShutter::covarianceByVelocity(const RolledPair& pair) const {
  if (!pair.mean_velocity || !pair.rate_by_rows) return Matrix6d::Zero();
  const double variance = varianceAt(pair);
  const Eigen::Matrix3d covariance =
      variance * (Eigen::Matrix3d::Identity() - gainOfRows(*pair.rate_by_rows, variance));
  const Matrix6d moment =
      pair.rate_by_rows->motion_by_rate * covariance * pair.rate_by_rows->motion_by_rate.transpose();
  return 0.5 * (moment + moment.transpose());
}

/// The second difference of three mean velocities has the variance a^2 dt.
void RollingShutter::learn(const RolledPair& pair, const Vector6d& next) {
  if (!pair.mean_velocity || !pair.mean_velocity_before) return;
  constexpr double kMemory = 1.0 / (1.0 - kUsualMemory);  // pairs
  const Eigen::Vector3d difference = (next - 2.0 * *pair.mean_velocity + *pair.mean_velocity_before).tail<3>();
  learnt_pairs_ = std::min(learnt_pairs_ + 1.0, kMemory);
  acceleration_square_ += (difference.squaredNorm() / (3.0 * pair.dt) - acceleration_square_) / (1.0 + learnt_pairs_);
}

}  // namespace sdvo
