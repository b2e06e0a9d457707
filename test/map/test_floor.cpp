#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "../../src/map/floor.hpp"

namespace sdvo::test_floor {

/// Looks ahead and down a little, from half a metre above the base.
Eigen::Isometry3d mount() {
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_base_camera.linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()) * T_base_camera.linear();
  T_base_camera.translation() << 0.3, 0.1, 0.5;
  return T_base_camera;
}

/// T_camera_origin of a base on the floor.
Eigen::Isometry3d cameraOf(const Eigen::Isometry3d& T_floor_base) {
  return (mount().inverse() * T_floor_base * mount()).inverse();
}

TEST(Floor, ABaseThatDrivesAndTurnsOnItStaysOnIt) {
  const Floor floor({}, mount(), 0.0);
  const Eigen::Isometry3d driven =
      Eigen::Translation3d(3.0, -2.0, 0.0) * Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ());
  EXPECT_LT(floor.residual(cameraOf(driven)).norm(), 1e-9);
  EXPECT_TRUE(floor.base(cameraOf(driven)).isApprox(driven, 1e-12));
}

TEST(Floor, HeightAndTiltAreInStandardDeviations) {
  PlanarOptions options;
  options.planar_height_sigma = 0.02;
  options.planar_tilt_sigma = 0.5;
  const Floor floor(options, mount(), 1.0);
  const double pitch = 0.01;
  const Eigen::Isometry3d pitched =
      Eigen::Translation3d(3.0, -2.0, 1.1) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d residual = floor.residual(cameraOf(pitched));
  EXPECT_NEAR(residual[0], 5.0, 1e-9);
  EXPECT_NEAR(residual[1], std::sin(pitch) / (0.5 * M_PI / 180.0), 1e-9);
  EXPECT_NEAR(residual[2], 0.0, 1e-9);
}

TEST(Floor, DerivativesAreThoseOfDifferences) {
  const Floor floor({}, mount(), 0.2);
  const Eigen::Isometry3d T = cameraOf(Eigen::Translation3d(1.0, 2.0, 0.3) *
                                       Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.1, 0.2, 1.0).normalized()));
  Floor::Jacobian jacobian;
  floor.residual(T, &jacobian);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kStep * Vector6d::Unit(k);
    const Eigen::Vector3d difference = floor.residual(expSE3(step) * T) - floor.residual(expSE3(-step) * T);
    EXPECT_LT((difference / (2.0 * kStep) - jacobian.col(k)).norm(), 1e-5) << k;
  }
}

TEST(Floor, APoseSettlesByAsMuchAsItsCovarianceLeavesRoomFor) {
  const Floor floor({}, mount(), 0.0);
  const Eigen::Isometry3d lifted =
      cameraOf(Eigen::Translation3d(3.0, -2.0, 0.02) * Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ()));
  const double before = floor.residual(lifted).norm();
  const Matrix6d certain = 1e-12 * Matrix6d::Identity(), uncertain = 4.0 * Matrix6d::Identity();
  EXPECT_NEAR(floor.residual(floor.settled(lifted, certain)).norm(), before, 1e-3);
  // The pose's own covariance is never wider than the floor's, so half of the way is left.
  EXPECT_LT(floor.residual(floor.settled(lifted, uncertain)).norm(), 0.6 * before);
  EXPECT_GT(floor.residual(floor.settled(lifted, uncertain)).norm(), 0.4 * before);
  const Eigen::Isometry3d on_a_ramp =
      cameraOf(Eigen::Translation3d(3.0, -2.0, 0.02) * Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(floor.settled(on_a_ramp, uncertain).isApprox(on_a_ramp, 0.0));
}

TEST(Floor, TheCovarianceIsNoLargerThanTheFloorAllows) {
  PlanarOptions options;
  const Floor floor(options, mount(), 0.0);
  const Eigen::Isometry3d driven =
      Eigen::Translation3d(30.0, -2.0, 0.0) * Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ());
  const Matrix6d covariance = Vector6d::Constant(4.0).asDiagonal();
  const Matrix6d of_camera = floor.constrained(cameraOf(driven).inverse(), covariance);
  const Matrix6d ad = adjoint(mount());
  const Matrix6d of_base = ad * of_camera * ad.transpose();
  EXPECT_LT(of_base(2, 2), options.planar_height_sigma * options.planar_height_sigma);
  const double tilt = options.planar_tilt_sigma * M_PI / 180.0;
  EXPECT_LT(of_base(3, 3), tilt * tilt);
  EXPECT_LT(of_base(4, 4), tilt * tilt);
  EXPECT_GT(of_base(0, 0), 1.0);
  EXPECT_GT(of_base(1, 1), 1.0);
  EXPECT_GT(of_base(5, 5), 1.0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(of_camera).eigenvalues().minCoeff(), 0.0);
}

}  // namespace sdvo::test_floor
