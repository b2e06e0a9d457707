#include <gtest/gtest.h>

#include "../../src/places/eased_transform.hpp"

namespace sdvo::test_eased_transform {

Eigen::Isometry3d target(double x, double turn) {
  return Eigen::Translation3d(x, 0.0, 0.0) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
}

TEST(EasedTransform, ArrivesSmoothlyAndStays) {
  EasedTransform eased(2.0);
  EXPECT_TRUE(eased.at(5.0).isApprox(Eigen::Isometry3d::Identity()));
  eased.moveTo(target(4.0, 1.0), 10.0);
  EXPECT_TRUE(eased.at(10.0).isApprox(Eigen::Isometry3d::Identity())) << "no jump";
  EXPECT_TRUE(eased.at(11.0).isApprox(target(2.0, 0.5), 1e-9)) << "half of the way at half of the time";
  EXPECT_LT(eased.at(10.01).translation().x(), 0.001) << "no speed at the start";
  EXPECT_GT(eased.at(11.99).translation().x(), 3.999) << "nor at the end";
  EXPECT_TRUE(eased.at(12.0).isApprox(target(4.0, 1.0)));
  EXPECT_TRUE(eased.at(99.0).isApprox(target(4.0, 1.0)));
}

TEST(EasedTransform, ANewTargetOnTheWayIsNoJump) {
  EasedTransform eased(2.0);
  eased.moveTo(target(4.0, 0.0), 0.0);
  const Eigen::Isometry3d before = eased.at(1.0);
  eased.moveTo(target(-4.0, 0.0), 1.0);
  EXPECT_TRUE(eased.at(1.0).isApprox(before));
  EXPECT_TRUE(eased.at(3.0).isApprox(target(-4.0, 0.0)));
}

TEST(EasedTransform, AClockSetBackDoesNotTakeItBack) {
  EasedTransform eased(2.0);
  eased.moveTo(target(4.0, 1.0), 10.0);
  EXPECT_TRUE(eased.at(12.0).isApprox(target(4.0, 1.0)));
  EXPECT_TRUE(eased.at(3.0).isApprox(target(4.0, 1.0)));
  eased.moveTo(target(6.0, 1.0), 3.0);
  EXPECT_TRUE(eased.at(3.0).isApprox(target(4.0, 1.0))) << "goes on from there";
}

TEST(EasedTransform, ADurationOfZeroIsAtOnce) {
  EasedTransform eased(0.0);
  eased.moveTo(target(4.0, 0.5), 1.0);
  EXPECT_TRUE(eased.at(1.0).isApprox(target(4.0, 0.5)));
}

}  // namespace sdvo::test_eased_transform
