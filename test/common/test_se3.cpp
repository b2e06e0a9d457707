#include <gtest/gtest.h>

#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_se3 {

Vector6d vector6(double x, double y, double z, double rx, double ry, double rz) {
  Vector6d xi;
  xi << x, y, z, rx, ry, rz;
  return xi;
}

/// From no rotation at all over tiny ones to almost half a turn.
std::vector<Vector6d> samples() {
  return {vector6(0, 0, 0, 0, 0, 0),
          vector6(1, -2, 3, 0, 0, 0),
          vector6(1, -2, 3, 1e-13, 0, -1e-13),
          vector6(1, -2, 3, 3e-7, 2e-7, -1e-7),
          vector6(1, -2, 3, 2e-6, 0, 1e-6),
          vector6(0.3, 0.2, -0.1, 0.01, -0.02, 0.005),
          vector6(-5, 1, 2, 0.5, 1.2, -0.7),
          vector6(4, 0, -1, 0, 3.1, 0),
          vector6(0, 0, 0, 1, 1, 1)};
}

/// exp of the 4x4 matrix by its series, scaled down and squared up again: the definition, independent of closed forms.
Eigen::Matrix4d exponentialSeries(const Vector6d& xi) {
  constexpr int kHalvings = 10, kTerms = 20;
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator.topLeftCorner<3, 3>() = skew(xi.tail<3>());
  generator.topRightCorner<3, 1>() = xi.head<3>();
  generator /= std::pow(2.0, kHalvings);
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = Eigen::Matrix4d::Identity();
  for (int k = 1; k < kTerms; ++k) {
    term = (term * generator / k).eval();
    sum += term;
  }
  for (int k = 0; k < kHalvings; ++k) sum = (sum * sum).eval();
  return sum;
}

TEST(Se3, SkewIsTheCrossProduct) {
  const Eigen::Vector3d a(1.0, -2.0, 3.0), b(0.5, 4.0, -1.0);
  EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(Se3, ExpIsTheMatrixExponential) {
  for (const Vector6d& xi : samples())
    EXPECT_LT((expSE3(xi).matrix() - exponentialSeries(xi)).norm(), 1e-9) << xi.transpose();
}

TEST(Se3, LogInvertsExp) {
  for (const Vector6d& xi : samples()) {
    EXPECT_LT((logSE3(expSE3(xi)) - xi).norm(), 1e-9) << xi.transpose();
    EXPECT_LT((expSE3(logSE3(expSE3(xi))).matrix() - expSE3(xi).matrix()).norm(), 1e-9) << xi.transpose();
  }
}

TEST(Se3, AdjointCarriesPerturbationsToTheOtherSide) {
  for (const Vector6d& pose : samples())
    for (const Vector6d& xi : samples()) {
      const Eigen::Isometry3d T = expSE3(pose);
      const Eigen::Isometry3d right = T * expSE3(xi), left = expSE3(adjoint(T) * xi) * T;
      EXPECT_LT((right.matrix() - left.matrix()).norm(), 1e-8) << pose.transpose() << " and " << xi.transpose();
    }
}

TEST(Se3, CovariancesAreCarriedAsTheirPerturbations) {
  for (const Vector6d& pose : samples())
    for (const Vector6d& xi : samples()) {
      const Eigen::Isometry3d T = expSE3(pose);
      const Vector6d moved = adjoint(T) * xi;
      EXPECT_LT((carried(T, xi * xi.transpose()) - moved * moved.transpose()).norm(),
                1e-9 * (1.0 + moved.squaredNorm()));
    }
  EXPECT_EQ(isotropic(4.0, 9.0).diagonal(), vector6(4, 4, 4, 9, 9, 9));
}

TEST(Se3, OrthonormalisedRestoresARotation) {
  Eigen::Isometry3d T = expSE3(vector6(1, 2, 3, 0.4, -0.8, 0.1));
  const Eigen::Isometry3d clean = T;
  T.linear() += 1e-4 * Eigen::Matrix3d::Ones();
  const Eigen::Isometry3d repaired = orthonormalised(T);
  EXPECT_LT((repaired.linear() * repaired.linear().transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(repaired.linear().determinant(), 1.0, 1e-12);
  // The repair moves the rotation by no more than a few times the damage, and not the position.
  EXPECT_LT((repaired.linear() - clean.linear()).norm(), 1e-3);
  EXPECT_EQ(repaired.translation(), clean.translation());
}

}  // namespace sdvo::test_se3
