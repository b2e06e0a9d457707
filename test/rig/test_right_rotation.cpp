#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <map>
#include <random>

#include "../../src/motion/pose_problem.hpp"
#include "../../src/rig/right_rotation.hpp"
#include "../../src/rig/row_delay.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_right_rotation {

/// Where a right camera that turned by `rotation` sees what it saw at (u, v) before.
Eigen::Vector2d seenTurned(const StereoCamera& camera, double u, double v, const Eigen::Vector3d& rotation) {
  const Eigen::Vector3d ray =
      expSO3(-rotation) * Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
  return {camera.fx * ray.x() / ray.z() + camera.cx, camera.fy * ray.y() / ray.z() + camera.cy};
}

TEST(RightRotation, JacobianIsThatOfTurnedRays) {
  const StereoCamera camera = synthetic::camera();
  for (const double u : {20.0, 300.0, 610.0})
    for (const double v : {10.0, 450.0})
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d rotation = 1e-5 * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector2d moved = seenTurned(camera, u, v, rotation) - Eigen::Vector2d(u, v);
        EXPECT_LT((rotationJacobian(camera, u, v) * rotation - moved).norm(), 1e-3 * moved.norm() + 1e-6);
      }
}

TEST(RightRotation, IsTakenBack) {
  const Eigen::Vector3d rotation(1e-3, -2e-3, 3e-3);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  features.append({400.f, 100.f, 30.f, 0.2f, 10.f, -1.f, 1.f});
  features.append({50.f, 400.f, 1e-3f, 0.f, 10.f, -1.f, 1.f});  // nearly at infinity
  StereoFeatures turned = features;
  for (int i = 0; i < features.count(); ++i) {
    const Eigen::Vector2d right =
        seenTurned(features.camera, features.u[i] - features.disparity[i], features.v[i] + features.dv[i], rotation);
    turned.disparity[i] = static_cast<float>(features.u[i] - right.x());
    turned.dv[i] = static_cast<float>(right.y() - features.v[i]);
  }
  const StereoFeatures back = rotatedBack(turned, rotation);
  EXPECT_NEAR(back.disparity[0], features.disparity[0], 0.01);
  EXPECT_NEAR(back.dv[0], features.dv[0], 0.01);
  EXPECT_GT(rotatedBack(features, -rotation).disparity[1], 0.f) << "no point ends behind infinity";
}

/// rotationByDisparities() in plain form, as many steps as are given.
RightRotation plainRotation(const StereoCamera& camera, const NoiseOptions& noise,
                            const std::vector<Correspondence>& correspondences, Eigen::Isometry3d T, int steps) {
  using Vector = Eigen::Matrix<double, 9, 1>;
  using Matrix = Eigen::Matrix<double, 9, 9>;
  const double of_disparity = std::hypot(noise.disparity, noise.common_disparity);
  const Eigen::Vector3d scale = Eigen::Vector3d(noise.corner, noise.corner, of_disparity).cwiseInverse();
  RightRotation found;
  for (int step = 0;; ++step) {
    Matrix hessian = Matrix::Identity();
    hessian.diagonal().head<3>() /= camera.baseline * camera.baseline;
    std::map<int, Vector> gradients;
    for (const Correspondence& c : correspondences) {
      std::optional<Eigen::Vector3d> residual = reprojectionResidual(camera, T, c);
      if (!residual) continue;
      Eigen::Matrix<double, 3, 9> jacobian = Eigen::Matrix<double, 3, 9>::Zero();
      jacobian.leftCols<6>() = motionJacobian(camera, T, c.point);
      jacobian.row(2) = jacobian.row(0) - jacobian.row(2);
      jacobian.bottomRightCorner<1, 3>() = -rotationJacobian(camera, c.measurement.z(), c.measurement.y()).row(0);
      (*residual)[2] = (*residual)[0] - (*residual)[2] - jacobian.bottomRightCorner<1, 3>().dot(found.value);
      jacobian = scale.asDiagonal() * jacobian;
      *residual = scale.cwiseProduct(*residual);
      const double weight = noiseGate(3) / (noiseGate(3) + residual->squaredNorm());
      hessian += weight * jacobian.transpose() * jacobian;
      const int part = RowDelay::partOf(c.measurement.x(), c.measurement.y(), camera.width, camera.height);
      gradients.try_emplace(part, Vector::Zero()).first->second += weight * jacobian.transpose() * *residual;
    }
    if (step == steps) {
      Matrix meat = hessian;
      for (const auto& [part, gradient] : gradients) meat += gradient * gradient.transpose();
      found.covariance = (hessian.inverse() * meat * hessian.inverse()).bottomRightCorner<3, 3>();
      return found;
    }
    Vector gradient = Vector::Zero();
    for (const auto& [part, of_part] : gradients) gradient += of_part;
    const Vector moved = hessian.ldlt().solve(gradient);
    T = expSE3(Vector6d(moved.head<6>())) * T;
    found.value += moved.tail<3>();
  }
}

TEST(RightRotation, VectorsGiveWhatThePlainFormGives) {
  const StereoCamera camera = synthetic::camera();
  const NoiseOptions noise;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Correspondence> correspondences;
  std::vector<int> all;
  for (int i = 0; i < 203; ++i) {  // no whole number of registers
    const Eigen::Vector3d point(8.0 * uniform(random), 4.0 * uniform(random), 13.0 + 8.0 * uniform(random));
    const Eigen::Vector3d off(uniform(random), uniform(random), 4.0 + uniform(random));  // px
    all.push_back(i), correspondences.push_back({point, camera.project(point) + off});
  }
  correspondences[7].point.z() = -1.0;  // behind the camera
  const auto found = rotationByDisparities(camera, noise, correspondences, all, Eigen::Isometry3d::Identity());
  ASSERT_TRUE(found);
  double nearest = 1.0;  // relative, over the numbers of steps that it may take
  for (int steps = 1; steps <= 3; ++steps) {
    const RightRotation plain = plainRotation(camera, noise, correspondences, Eigen::Isometry3d::Identity(), steps);
    nearest = std::min(nearest, (found->value - plain.value).norm() / plain.value.norm());
    if (steps == 3) {
      EXPECT_LT((found->covariance - plain.covariance).norm(), 0.05 * plain.covariance.norm());
    }
  }
  EXPECT_LT(nearest, 1e-9);
  EXPECT_FALSE(rotationByDisparities(camera, noise, {}, {}, Eigen::Isometry3d::Identity()));
}

}  // namespace sdvo::test_right_rotation
