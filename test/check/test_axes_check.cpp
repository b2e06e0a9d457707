#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "../../src/check/axes_check.hpp"

namespace sdvo {
namespace test_axes_check {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

Verdict verdictOf(const Matrix3d& R_base_camera, const Vector3d& step) {
  OpticalAxisCheck check;
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() = R_base_camera;
  for (int i = 0; i < 60; ++i) check.add(T_base_camera, step);
  return check.judge().verdict;
}

/// A camera that looks along its z axis moves along it where a robot drives.
TEST(OpticalAxisCheck, ABodysFrameIsNoOpticalOne) {
  const Vector3d ahead(0.001, 0.0, 0.02);
  for (const double yaw : {0.0, 90.0, 180.0})
    for (const double pitch : {0.0, 5.0, 30.0})
      EXPECT_EQ(
          verdictOf((AngleAxisd(yaw * kDegree, Vector3d::UnitZ()) * AngleAxisd(pitch * kDegree, Vector3d::UnitY()))
                        .toRotationMatrix(),
                    ahead),
          Verdict::kWarn)
          << yaw << " " << pitch;
}

TEST(OpticalAxisCheck, ACameraThatLooksAheadOrToTheCeilingIsFine) {
  Matrix3d ahead;
  ahead << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_EQ(verdictOf(ahead, {0.0, 0.0, 0.02}), Verdict::kOpen);
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), {0.02, 0.0, 0.001}), Verdict::kOk) << "under a ceiling";
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), {0.0, 0.0, 0.001}), Verdict::kOpen) << "standing";
}

Verdict verdictOf(const Matrix3d& R_camera_imu, double scale, const Vector3d& step) {
  GyroAxesCheck check;
  for (int i = 0; i < 60; ++i) {
    const Vector3d turn = step + 0.1 * step.norm() * Vector3d(std::sin(i), std::cos(i), 0.0);
    check.add(AngleAxisd(scale * turn.norm(), R_camera_imu * turn.normalized()).toRotationMatrix(),
              AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix());
  }
  return check.judge().verdict;
}

TEST(GyroAxesCheck, AMountingThatTfDoesNotHaveIsNamed) {
  const Vector3d yaw(0.0, 1.0 * kDegree, 0.0);  // of a camera that looks ahead
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), 1.0, yaw), Verdict::kOk);
  EXPECT_EQ(verdictOf(AngleAxisd(10.0 * kDegree, Vector3d::UnitX()).toRotationMatrix(), 1.1, yaw), Verdict::kOk);
  for (const double angle : {90.0, 180.0})
    EXPECT_EQ(verdictOf(AngleAxisd(angle * kDegree, Vector3d::UnitX()).toRotationMatrix(), 1.0, yaw), Verdict::kWarn)
        << angle;
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), 180.0 / M_PI, 0.02 * yaw / kDegree), Verdict::kWarn) << "degrees";
}

TEST(GyroAxesCheck, NothingIsSaidWithoutATurn) {
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), 1.0, {0.0, 0.1 * kDegree, 0.0}), Verdict::kOpen);
}

TEST(GyroAxesCheck, AMoverInTheViewIsNoFaultOfTheGyro) {
  EXPECT_EQ(verdictOf(AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix(), 0.05, {0.0, 1.0 * kDegree, 0.0}),
            Verdict::kOk);
}

}  // namespace test_axes_check
}  // namespace sdvo
