#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "../../src/messages/pose_conversions.hpp"
#include "../said.hpp"

namespace sdvo::ros_conversions::test_pose_conversions {

geometry_msgs::PoseWithCovariance poseWith(const Matrix6d& covariance) {
  geometry_msgs::PoseWithCovariance message;
  message.pose.orientation.w = 1.0;
  for (int i = 0; i < 36; ++i) message.covariance[i] = covariance(i / 6, i % 6);
  return message;
}

Matrix6d taken(const Matrix6d& sent) {
  Eigen::Isometry3d pose;
  Matrix6d covariance;
  fromMessage(poseWith(sent), pose, covariance);
  EXPECT_EQ(covariance, covariance.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues()[0], 0.0);
  return covariance;
}

std::string refusal(const Matrix6d& sent) {
  return errorOf([&] { taken(sent); });
}

TEST(Poses, WhatIsNowhereIsRefused) {
  for (const char* text : {"", "1 2 3", "1 2 3 0 0 0 0", "1, 2, 3, 0, 0, 0", "1 2 3 0 0 nan", "1 2 3 0 0 x",
                           "1e300 0 0 0 0 0", "0 0 0 0 0 90"})
    EXPECT_THROW(toPose(text), std::invalid_argument) << text;
  EXPECT_NO_THROW(toPose("500000 9000000 100 0 0 -6.28"));  // UTM
  geometry_msgs::Pose pose;
  pose.orientation.w = 1.0;
  pose.position.y = 1e300;
  EXPECT_THROW(toPose(pose), std::invalid_argument);
}

/// x, y and yaw as rviz' "2D Pose Estimate" and AMCL have them.
Matrix6d planar() {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 0.25, 0.25, 0.0, 0.0, 0.0, 0.0685;
  return covariance;
}

TEST(PoseConversions, VariancesOfZeroAreAMillimetreAndAMilliradian) {
  const Matrix6d covariance = taken(planar());
  EXPECT_EQ(covariance(0, 0), 0.25);
  for (int axis : {2, 3, 4}) EXPECT_EQ(covariance(axis, axis), 1e-6);
  EXPECT_EQ(covariance(5, 5), 0.0685);
  EXPECT_TRUE(taken(Matrix6d::Zero()).isApprox(1e-6 * Matrix6d::Identity()));
}

TEST(PoseConversions, EitherTriangleIsEnough) {
  Matrix6d both = planar();
  both(0, 1) = both(1, 0) = 0.1;
  both(1, 5) = both(5, 1) = -0.05;
  const Matrix6d upper = both.triangularView<Eigen::Upper>(), lower = both.triangularView<Eigen::Lower>();
  EXPECT_EQ(taken(upper), taken(both));
  EXPECT_EQ(taken(lower), taken(both));
}

TEST(PoseConversions, FullyCorrelatedAxesAreTaken) {
  Matrix6d covariance = planar();
  covariance(0, 1) = covariance(1, 0) = 0.25;
  EXPECT_NEAR(taken(covariance)(0, 1), 0.25, 1e-9);
}

TEST(PoseConversions, RefusalsSayWhichElementToChange) {
  Matrix6d wrong = planar();
  wrong(5, 5) = -1.0;
  expectWords(refusal(wrong), {"variance of yaw is negative", "m^2 or rad^2"});
  wrong(5, 5) = 1e300;
  EXPECT_TRUE(contains(refusal(wrong), "variance of yaw is beyond 1e16"));
  wrong(5, 5) = 1e9;
  EXPECT_EQ(refusal(wrong), "no error") << "for what is not known";
  wrong = planar();
  wrong(0, 1) = std::nan("");
  expectWords(refusal(wrong), {"covariance of y and x is not finite", "0 if it is not known"});
  wrong = planar();
  wrong(0, 1) = wrong(1, 0) = 0.3;
  EXPECT_TRUE(contains(refusal(wrong), "covariance of y and x exceeds what their variances allow"));
  wrong = planar();
  wrong(0, 1) = 0.1;
  wrong(1, 0) = -0.1;
  EXPECT_TRUE(contains(refusal(wrong), "covariance of y and x has two values"));
  geometry_msgs::PoseWithCovariance unset;
  Eigen::Isometry3d pose;
  Matrix6d covariance;
  EXPECT_THROW(fromMessage(unset, pose, covariance), std::invalid_argument);
}

}  // namespace sdvo::ros_conversions::test_pose_conversions
