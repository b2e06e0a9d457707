#include "right_rotation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../common/statistics.hpp"
#include "../motion/pose_problem.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {

Eigen::Matrix<double, 2, 3> rotationJacobian(const StereoCamera& camera, double u, double v) {
  const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << camera.fx * x * y, -camera.fx * (1.0 + x * x), camera.fx * y,  //
      camera.fy * (1.0 + y * y), -camera.fy * x * y, -camera.fy * x;
  return jacobian;
}

StereoFeatures rotatedBack(const StereoFeatures& features, const Eigen::Vector3d& rotation) {
  constexpr double kFar = std::numeric_limits<float>::epsilon();  // px: for points that end beyond infinity
  StereoFeatures result = features;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector2d moved =
        rotationJacobian(features.camera, features.u[i] - features.disparity[i], features.v[i] + features.dv[i]) *
        rotation;
    result.disparity[i] =
        static_cast<float>(std::clamp<double>(features.disparity[i] + moved.x(), kFar, features.camera.width));
    result.dv[i] -= static_cast<float>(moved.y());
  }
  return result;
}

Eigen::Vector3d yawByDisparities(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
                                 const Eigen::Isometry3d& T_current_reference) {
  std::vector<double> yaws;
  for (const Correspondence& c : correspondences) {
    const std::optional<Eigen::Vector3d> residual = reprojectionResidual(camera, T_current_reference, c);
    if (residual)
      yaws.push_back((residual->z() - residual->x()) /
                     rotationJacobian(camera, c.measurement.z(), c.measurement.y())(0, 1));
  }
  return {0.0, median(yaws), 0.0};
}

std::optional<RightRotation> rotationByDisparities(const StereoCamera& camera, const NoiseOptions& noise,
                                                   const std::vector<Correspondence>& correspondences,
                                                   const std::vector<int>& inliers,
                                                   const Eigen::Isometry3d& T_current_reference) {
  constexpr double kSmall = 0.01;  // squared standard deviations (chosen): equations from before such a step serve
  constexpr int kSteps = 3, kMotion = 6, kUnknowns = kMotion + 3;
  constexpr double kCauchy = noiseGate(3);  // squared scale of Cauchy's kernel, in standard deviations
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  if (static_cast<int>(inliers.size()) < kFewestMeasured) return std::nullopt;
  const double of_disparity = std::hypot(noise.disparity, noise.common_disparity);
  const Eigen::Vector3d scale = Eigen::Vector3d(noise.corner, noise.corner, of_disparity).cwiseInverse();

  Eigen::Isometry3d T = T_current_reference;
  RightRotation found;
  Matrix hessian;
  std::array<Vector, RowDelay::kParts> gradients;
  for (int step = 0;; ++step) {
    hessian.setIdentity();  // prior of a baseline and 1 rad, for what the view does not constrain
    hessian.diagonal().head<3>() /= camera.baseline * camera.baseline;
    gradients.fill(Vector::Zero());
    for (const int i : inliers) {
      const Correspondence& c = correspondences[static_cast<std::size_t>(i)];
      std::optional<Eigen::Vector3d> residual = reprojectionResidual(camera, T, c);
      if (!residual) continue;
      Eigen::Matrix<double, 3, kUnknowns> jacobian = Eigen::Matrix<double, 3, kUnknowns>::Zero();
      jacobian.leftCols<kMotion>() = motionJacobian(camera, T, c.point);
      // The disparity replaces u_right, whose error is mostly that of u_left.
      jacobian.row(2) = jacobian.row(0) - jacobian.row(2);
      jacobian.bottomRightCorner<1, 3>() = -rotationJacobian(camera, c.measurement.z(), c.measurement.y()).row(0);
      (*residual)[2] = (*residual)[0] - (*residual)[2] - jacobian.bottomRightCorner<1, 3>().dot(found.value);
      jacobian = scale.asDiagonal() * jacobian;
      *residual = scale.cwiseProduct(*residual);
      const double weight = kCauchy / (kCauchy + residual->squaredNorm());
      const Eigen::Matrix<double, kUnknowns, 3> weighted = weight * jacobian.transpose();
      hessian += weighted.lazyProduct(jacobian);  // a general product takes six times as long
      const int part = RowDelay::cellOf(c.measurement.x(), c.measurement.y(), camera.width, camera.height);
      gradients[static_cast<std::size_t>(part)] += weighted * *residual;
    }
    if (step == kSteps) break;
    Vector gradient = Vector::Zero();
    for (const Vector& of_part : gradients) gradient += of_part;
    const Vector moved = hessian.ldlt().solve(gradient);
    if (!moved.allFinite()) return std::nullopt;
    T = expSE3(Vector6d(moved.head<kMotion>())) * T;
    found.value += moved.tail<3>();
    if (gradient.dot(moved) < kSmall) break;
  }
  Matrix meat = hessian;  // lower bound: correlated errors of a part may cancel by chance
  for (const Vector& of_part : gradients) meat += of_part * of_part.transpose();
  const Matrix inverse = hessian.inverse();
  found.covariance = (inverse * meat * inverse).bottomRightCorner<3, 3>();
  found.spread =
      static_cast<double>(inliers.size()) / (3.0 * of_disparity * of_disparity) * inverse.bottomRightCorner<3, 3>();
  return found;
}

}  // namespace sdvo
