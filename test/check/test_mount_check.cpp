#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../src/check/mount_check.hpp"
#include "../said.hpp"

namespace sdvo::test_mount_check {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

/// A camera 0.5 m above the floor that looks ahead, pitched down by `pitch` and rolled by `roll`, deg.
Isometry3d mount(double pitch, double roll = 0.0) {
  Isometry3d T = Isometry3d(Eigen::Translation3d(0.2, 0.0, 0.5));
  Eigen::Matrix3d R_link_optical;
  R_link_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T.linear() = (AngleAxisd(pitch * kDegree, Vector3d::UnitY()) * AngleAxisd(roll * kDegree, Vector3d::UnitX()))
                   .toRotationMatrix() *
               R_link_optical;
  return T;
}

/// 6 m with a bend, of a camera that is mounted otherwise than it is told. `shake`: deg, in pitch and roll.
Finding drive(const Isometry3d& real, const Isometry3d& told, double bend = 25.0, double shake = 0.0) {
  MountCheck check;
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int i = 0; i < 110; ++i) {
    const double yaw = i > 40 && i < 70 ? bend * kDegree / 30.0 : 0.0;
    Isometry3d step = Isometry3d(Eigen::Translation3d(0.055, 0.0, 0.0));
    step.linear() = (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(shake * kDegree * std::sin(i), Vector3d::UnitY()))
                        .toRotationMatrix();
    Isometry3d motion = real.inverse() * step * real;
    motion.translation() += 5e-4 * Vector3d(noise(random), noise(random), noise(random));
    motion.linear() = motion.linear() * AngleAxisd(2e-4 * noise(random), Vector3d::UnitX()).toRotationMatrix();
    check.add(told, motion);
  }
  return check.judge(0.3);
}

TEST(MountCheck, AMountThatIsPitchedOrRolledOtherwiseIsNamedWithTheRightOne) {
  for (const double pitch : {-6.0, 1.0, 3.0, 6.0}) {
    const Finding finding = drive(mount(10.0), mount(10.0 - pitch));
    EXPECT_EQ(finding.verdict, Verdict::kWarn) << pitch;
    expectWords(finding.remedy, {"mount", "0.17"});  // 10 deg
    EXPECT_TRUE(contains(finding.what, "down by " + std::to_string(static_cast<int>(pitch)) + ".0")) << finding.what;
  }
  expectWords(drive(mount(10.0, 3.0), mount(10.0)).remedy, {"0.05"});
  expectWords(drive(mount(10.0, 3.0), mount(10.0)).what, {"rolled by 3."});
  EXPECT_EQ(drive(mount(10.0, 3.0), mount(10.0)).verdict, Verdict::kWarn);
}

TEST(MountCheck, ARightMountIsFine) {
  for (const double shake : {0.0, 1.0}) EXPECT_EQ(drive(mount(10.0), mount(10.0), 25.0, shake).verdict, Verdict::kOk);
  EXPECT_EQ(drive(mount(10.0), mount(9.8)).verdict, Verdict::kOk) << "as it is trusted";
  EXPECT_EQ(drive(mount(10.0, 3.0), mount(10.0), 0.0).verdict, Verdict::kOk) << "a straight way does not show a roll";
  EXPECT_FALSE(contains(drive(mount(10.0, 3.0), mount(10.0), 0.0).what, "rolled")) << "… and it is not told";
  EXPECT_FALSE(contains(drive(mount(10.0), mount(7.0), 0.0).what, "rolled"));
  EXPECT_EQ(MountCheck().judge(0.3).verdict, Verdict::kOpen);
}

}  // namespace sdvo::test_mount_check
