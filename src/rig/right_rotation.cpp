#include "right_rotation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "../common/statistics.hpp"
#include "../motion/pose_problem.hpp"
#include "../motion/projected.hpp"
#include "row_delay.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

constexpr int kMotion = 6, kUnknowns = kMotion + 3;  // a left perturbation of the motion (m, rad), and the rotation
using UnknownsVector = Eigen::Matrix<double, kUnknowns, 1>;
using UnknownsMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Noise of the equations, and where they are linearised.
struct RotationEquations {
  Projection projection;
  double inverse_noise[3];  ///< of u, v and disparity, 1/px
  double rotation[3];       ///< rad
};

/// The Hessian's upper triangle, and columns that each correspondence adds to the gradient.
struct AddRotationEquations {
  static SDVO_IN_KERNEL void run(const RotationEquations* equations, const double* values, std::ptrdiff_t stride,
                                 int count, DoubleLanes* hessian, double* gradients) {
    constexpr double kCauchy = noiseGate(3);  // squared scale of Cauchy's kernel, in standard deviations
    const Projection& p = equations->projection;
    const double inverse_fx = 1.0 / p.fx, inverse_fy = 1.0 / p.fy;
    for (int k = 0; k < count; k += CorrespondenceArrays::kLanes) {
      const Projected at(p, values + k, stride);
      DoubleLanes x, y;  // in the right image
      load(values + 4 * stride + k, y), load(values + 5 * stride + k, x);
      x = (x - p.cx) * inverse_fx, y = (y - p.cy) * inverse_fy;
      const double *n = equations->inverse_noise, *w = equations->rotation;
      // Derivatives in standard deviations: of u by x and z, of v by y and z, of the disparity by z and by the
      // rotation.
      const DoubleLanes a = n[0] * p.fx * at.inverse_depth, b = n[1] * p.fy * at.inverse_depth;
      const DoubleLanes left = -a * at.x * at.inverse_depth, down = -b * at.y * at.inverse_depth;
      // The disparity replaces u_right, whose error is mostly that of u_left.
      const DoubleLanes nearer = -n[2] * p.fx_baseline * at.inverse_depth * at.inverse_depth;
      const DoubleLanes turned[3] = {-n[2] * p.fx * x * y, n[2] * p.fx * (1.0 + x * x), -n[2] * p.fx * y};
      const DoubleLanes u = n[0] * at.u_left, v = n[1] * at.v;
      const DoubleLanes disparity =
          n[2] * (at.u_left - at.u_right) - (turned[0] * w[0] + turned[1] * w[1] + turned[2] * w[2]);
      const DoubleLanes index = DoubleLanes{0.0, 1.0, 2.0, 3.0} + static_cast<double>(k), zero{};
      DoubleLanes weight = kCauchy / (kCauchy + (u * u + v * v + disparity * disparity));
      weight = index < static_cast<double>(count) ? weight : zero;
      weight = at.behind ? zero : weight;

      DoubleLanes gradient[kUnknowns] = {};
      const DoubleLanes of_u[] = {a, left, left * at.y, a * at.z - left * at.x, -a * at.y};
      const DoubleLanes of_v[] = {b, down, down * at.y - b * at.z, -down * at.x, b * at.x};
      const DoubleLanes of_disparity[] = {nearer, nearer * at.y, -nearer * at.x, turned[0], turned[1], turned[2]};
      addRow<kUnknowns>(of_u, {0, 2, 3, 4, 5}, weight, u, hessian, gradient);
      addRow<kUnknowns>(of_v, {1, 2, 3, 4, 5}, weight, v, hessian, gradient);
      addRow<kUnknowns>(of_disparity, {2, 3, 4, 6, 7, 8}, weight, disparity, hessian, gradient);
      for (int i = 0; i < kUnknowns; ++i) store(gradient[i], gradients + i * stride + k);
    }
  }
};

struct Inliers {
  const StereoCamera& camera;
  double corner_sigma, disparity_sigma;  ///< px
  CorrespondenceArrays arrays;
  std::vector<int> parts;  ///< of the image
};

/// Hessian, and gradients by part of the image.
struct Linearisation {
  UnknownsMatrix hessian;
  std::array<UnknownsVector, RowDelay::kParts> gradients;

  UnknownsVector gradient() const {
    UnknownsVector sum = UnknownsVector::Zero();
    for (const UnknownsVector& of_part : gradients) sum += of_part;
    return sum;
  }

  /// Covariance of the rotation: sandwich of the gradients between the Hessian's `inverse`.
  Eigen::Matrix3d sandwich(const UnknownsMatrix& inverse) const {
    UnknownsMatrix meat = hessian;  // lower bound: correlated errors of a part may cancel by chance
    for (const UnknownsVector& of_part : gradients) meat += of_part * of_part.transpose();
    return (inverse * meat * inverse).bottomRightCorner<3, 3>();
  }
};

Linearisation linearise(const Inliers& inliers, const Eigen::Isometry3d& T, const Eigen::Vector3d& rotation) {
  const StereoCamera& camera = inliers.camera;
  const std::ptrdiff_t stride = CorrespondenceArrays::roundedUp(inliers.arrays.count());
  const RotationEquations equations{
      Projection(camera, T),
      {1.0 / inliers.corner_sigma, 1.0 / inliers.corner_sigma, 1.0 / inliers.disparity_sigma},
      {rotation.x(), rotation.y(), rotation.z()}};
  DoubleLanes sums[kUnknowns * kUnknowns] = {};
  std::vector<double> columns(static_cast<std::size_t>(kUnknowns * stride));
  runKernel<AddRotationEquations>(&equations, inliers.arrays.values(), stride, inliers.arrays.count(), +sums,
                                  columns.data());
  Linearisation result;
  result.hessian.setIdentity();  // prior of a baseline and 1 rad, for what the view does not constrain
  result.hessian.diagonal().head<3>() /= camera.baseline * camera.baseline;
  for (int i = 0; i < kUnknowns; ++i)
    for (int j = i; j < kUnknowns; ++j)
      result.hessian(i, j) += total(sums[kUnknowns * i + j]), result.hessian(j, i) = result.hessian(i, j);
  result.gradients.fill(UnknownsVector::Zero());
  for (std::size_t k = 0; k < inliers.parts.size(); ++k)
    for (int i = 0; i < kUnknowns; ++i)
      result.gradients[inliers.parts[k]][i] += columns[static_cast<std::size_t>(i * stride) + k];
  return result;
}

}  // namespace

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
  constexpr int kSteps = 3;
  if (static_cast<int>(inliers.size()) < kFewestMeasured) return std::nullopt;
  const double disparity_sigma = std::hypot(noise.disparity, noise.common_disparity);
  std::vector<Correspondence> some;
  std::vector<int> parts;
  some.reserve(inliers.size()), parts.reserve(inliers.size());
  for (const int i : inliers) {
    const Correspondence& c = some.emplace_back(correspondences[i]);
    parts.push_back(RowDelay::partOf(c.measurement.x(), c.measurement.y(), camera.width, camera.height));
  }
  const Inliers observed{camera, noise.corner, disparity_sigma, CorrespondenceArrays(some), std::move(parts)};
  Eigen::Isometry3d T = T_current_reference;
  RightRotation found;
  Linearisation equations = linearise(observed, T, found.value);
  for (int step = 0; step < kSteps; ++step) {
    const UnknownsVector gradient = equations.gradient();
    const UnknownsVector step_of_all = equations.hessian.ldlt().solve(gradient);
    if (!step_of_all.allFinite()) return std::nullopt;
    T = expSE3(Vector6d(step_of_all.head<kMotion>())) * T;
    found.value += step_of_all.tail<3>();
    if (gradient.dot(step_of_all) < kSmall) break;
    equations = linearise(observed, T, found.value);
  }
  const UnknownsMatrix inverse = equations.hessian.inverse();
  found.covariance = equations.sandwich(inverse);
  // n / 3 times (J^T J)^-1: rotations of this covariance shift the n disparities by 1 px rms.
  found.by_pixel = static_cast<double>(inliers.size()) / (3.0 * disparity_sigma * disparity_sigma) *
                   inverse.bottomRightCorner<3, 3>();
  return found;
}

}  // namespace sdvo
