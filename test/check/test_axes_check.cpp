#include <gtest/gtest.h>

#include <cmath>

#include "../../src/check/axes_check.hpp"
#include "../said.hpp"

namespace sdvo::test_axes_check {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

/// Of 60 steps that each turn by `turn`, rad.
Verdict verdictOf(const Matrix3d& R_base_camera, const Vector3d& step, const Vector3d& turn = Vector3d::Zero()) {
  OpticalAxisCheck check;
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity(), T_previous_current = Eigen::Isometry3d::Identity();
  T_base_camera.linear() = R_base_camera;
  T_previous_current.translation() = step;
  if (turn.norm() > 0.0) T_previous_current.linear() = AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  for (int i = 0; i < 60; ++i) check.add(T_base_camera, T_previous_current);
  return check.judge().verdict;
}

/// A camera that looks along its z axis moves along it where a robot drives.
TEST(CheckMount, ABodysAxesAreNoOpticalOnesButOfACameraThatIsTheBase) {
  const Eigen::Isometry3d same = Eigen::Isometry3d::Identity();
  EXPECT_EQ(checkMount("base_link", "camera", same).verdict, Verdict::kWarn);
  EXPECT_EQ(checkMount("base_link", "base_link", same).verdict, Verdict::kWarn) << "a robot's, by its name";
  EXPECT_EQ(checkMount("camera_optical", "camera_optical", same).verdict, Verdict::kOk);
}

TEST(OpticalAxisCheck, ABodysFrameIsNoOpticalOne) {
  const Vector3d ahead(0.001, 0.0, 0.02);
  for (const double yaw : {0.0, 90.0, 180.0})
    for (const double pitch : {0.0, 5.0, 30.0})
      EXPECT_EQ(
          verdictOf((AngleAxisd(yaw * kDegree, Vector3d::UnitZ()) * AngleAxisd(pitch * kDegree, Vector3d::UnitY()))
                        .toRotationMatrix(),
                    ahead, {0.0, 0.01, 0.0}),
          Verdict::kWarn)
          << yaw << " " << pitch;
}

TEST(OpticalAxisCheck, ACameraThatLooksUpAndClimbsIsFine) {
  const Vector3d up(0.0, 0.001, 0.02);
  for (const double yaw : {-90.0, 90.0})  // the image's bottom is ahead, or its top
    for (const Vector3d& turn : {Vector3d(0.0, 0.0, 0.0), Vector3d(0.001, 0.0, 0.02)})
      EXPECT_EQ(verdictOf(AngleAxisd(yaw * kDegree, Vector3d::UnitZ()).toRotationMatrix(), up, turn), Verdict::kOk);
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
    check.add(i, i + 1, AngleAxisd(scale * turn.norm(), R_camera_imu * turn.normalized()).toRotationMatrix(),
              AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix());
  }
  return check.judge([](std::int64_t, std::int64_t) { return std::nullopt; }).verdict;
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

TEST(GyroAxesCheck, StampsOfAnotherTimeAreNoFaultOfTheMount) {
  const auto shaken = [&](const Matrix3d& mount, double late) {
    GyroAxesCheck check;
    const auto turned = [](double t) {
      const Vector3d turn = 3.0 * kDegree * Vector3d(std::sin(12.0 * t), 0.3 * std::sin(9.0 * t), std::cos(12.0 * t));
      return AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    };
    const auto gyro = [&](std::int64_t from, std::int64_t) -> std::optional<Matrix3d> {
      return mount * turned(1e-9 * static_cast<double>(from) - late) * mount.transpose();
    };
    for (std::int64_t from = 0; from < 8'000'000'000; from += 50'000'000)
      check.add(from, from + 50'000'000, *gyro(from, 0), turned(1e-9 * static_cast<double>(from)));
    return check.judge(gyro);
  };
  const Matrix3d other = AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix();
  EXPECT_EQ(shaken(Matrix3d::Identity(), 0.02).verdict, Verdict::kOk);
  EXPECT_TRUE(contains(shaken(Matrix3d::Identity(), 0.1).remedy, "100 ms too late"));
  EXPECT_TRUE(contains(shaken(Matrix3d::Identity(), -0.08).remedy, "80 ms too early"));
  EXPECT_TRUE(contains(shaken(other, 0.0).remedy, "mounted"));
}

/// An hour of turns before does not outvote it.
TEST(GyroAxesCheck, AFaultThatBeginsLateIsNamed) {
  const AngleAxisd turn(1.0 * kDegree, Vector3d::UnitY());
  GyroAxesCheck check;
  const auto add = [&](int pairs, const Matrix3d& by_gyro) {
    for (int i = 0; i < pairs; ++i) check.add(i, i + 1, by_gyro, turn.toRotationMatrix());
    return check.judge([](std::int64_t, std::int64_t) { return std::nullopt; }).verdict;
  };
  EXPECT_EQ(add(3600, turn.toRotationMatrix()), Verdict::kOk);
  EXPECT_EQ(add(60, turn.inverse().toRotationMatrix()), Verdict::kWarn);
  EXPECT_EQ(add(60, turn.toRotationMatrix()), Verdict::kOk);
}

TEST(GyroAxesCheck, AnHourOfShakingInPlaceDoesNotOutweighATurn) {
  for (const double shaking : {0.3, 2.0}) {  // degrees a pair
    GyroAxesCheck check;
    const auto add = [&](int pairs, double by_gyro, double by_images) {
      const Vector3d axis = Vector3d::UnitY();
      for (int i = 0; i < pairs; ++i)
        check.add(i, i + 1, AngleAxisd(by_gyro * kDegree, axis).toRotationMatrix(),
                  AngleAxisd(by_images * kDegree, axis).toRotationMatrix());
    };
    add(36000, shaking, 0.0);
    add(25, 1.0, 1.0);
    EXPECT_EQ(check.judge([](std::int64_t, std::int64_t) { return std::nullopt; }).verdict, Verdict::kOk) << shaking;
  }
}

TEST(GyroAxesCheck, NothingIsSaidWithoutATurn) {
  EXPECT_EQ(verdictOf(Matrix3d::Identity(), 1.0, {0.0, 0.1 * kDegree, 0.0}), Verdict::kOpen);
}

TEST(GyroAxesCheck, AMoverInTheViewIsNoFaultOfTheGyro) {
  EXPECT_EQ(verdictOf(AngleAxisd(M_PI, Vector3d::UnitX()).toRotationMatrix(), 0.05, {0.0, 1.0 * kDegree, 0.0}),
            Verdict::kOk);
}

}  // namespace sdvo::test_axes_check
