#include <gtest/gtest.h>

#include "../../src/motion/pose_problem.hpp"
#include "../kernels.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_correspondence_arrays {

Eigen::Isometry3d someMotion() {
  Vector6d xi;
  xi << 0.1, -0.05, -1.2, 0.02, 0.03, -0.01;
  return expSE3(xi);
}

/// Some behind the camera, not a multiple of the lanes.
std::vector<Correspondence> someCorrespondences() {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> side(-8.0, 8.0), depth(-5.0, 40.0), noise(-2.0, 2.0);
  std::vector<Correspondence> all;
  for (int i = 0; i < 101; ++i) {
    const Eigen::Vector3d point(side(random), 0.3 * side(random), depth(random));
    Eigen::Vector3d measurement(300.0, 100.0, 290.0);
    const Eigen::Vector3d now = someMotion() * point;
    if (now.z() > 0.5)
      measurement = synthetic::camera().project(now) + Eigen::Vector3d(noise(random), noise(random), noise(random));
    all.push_back({point, measurement});
  }
  return all;
}

/// Squares, weights, hessian and gradient.
std::tuple<std::vector<double>, std::vector<double>, Matrix6d, Vector6d> evaluate(const CorrespondenceArrays& arrays) {
  const int count = CorrespondenceArrays::roundedUp(arrays.count());
  std::vector<double> squares(static_cast<std::size_t>(count)), weights;
  arrays.squareResiduals(synthetic::camera(), someMotion(), 0, count, squares.data());
  for (int i = 0; i < count; ++i) {
    const double square = squares[static_cast<std::size_t>(i)];
    weights.push_back(i < arrays.count() && std::isfinite(square) ? 1.0 / (1.0 + square) : 0.0);
  }
  Matrix6d hessian;
  Vector6d gradient;
  arrays.sumEquations(synthetic::camera(), someMotion(), weights.data(), hessian, gradient);
  return {squares, weights, hessian, gradient};
}

TEST(CorrespondenceArrays, AgreeWithTheCorrespondencesOneByOne) {
  const auto correspondences = someCorrespondences();
  const CorrespondenceArrays arrays(correspondences);
  const auto [squares, weights, found_hessian, found_gradient] = ofEveryKernel([&] { return evaluate(arrays); });
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  int behind = 0;
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    const auto residual = reprojectionResidual(synthetic::camera(), someMotion(), correspondences[i]);
    ASSERT_EQ(residual.has_value(), std::isfinite(squares[i])) << i;
    if (!residual) {
      ++behind;
      continue;
    }
    EXPECT_DOUBLE_EQ(squares[i], residual->squaredNorm()) << i;
    const auto jacobian = motionJacobian(synthetic::camera(), someMotion(), correspondences[i].point);
    hessian += weights[i] * jacobian.transpose() * jacobian;
    gradient += weights[i] * jacobian.transpose() * *residual;
  }
  EXPECT_GT(behind, 5);
  EXPECT_LT((found_hessian - hessian).norm(), 1e-12 * hessian.norm());
  EXPECT_LT((found_gradient - gradient).norm(), 1e-12 * gradient.norm());
}

}  // namespace sdvo::test_correspondence_arrays
