#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "stereo_descriptor_vo/odometry/motion_belief.hpp"

namespace sdvo {
namespace test_motion_belief {

/// A standard deviation of translation and one of rotation, the same in all directions.
void expectDeviations(const Matrix6d& covariance, double translation, double rotation) {
  Vector6d expected;
  expected << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  EXPECT_TRUE(covariance.isDiagonal());
  EXPECT_LT((covariance.diagonal().cwiseSqrt() - expected).norm(), 1e-12) << covariance.diagonal().transpose();
}

TEST(MotionCovariances, APredictionErrsByTheAcceleration) {
  // A body at a constant 5 m/s^2 covers 5 * 0.2^2 m more in each interval of 0.2 s than in the one before.
  expectDeviations(predictionCovariance(0.2), 5.0 * 0.04, 2.0 * 0.04);
}

TEST(MotionCovariances, UnseenTravelIsBoundedByTheSpeedAndByATurn) {
  Vector6d velocity = Vector6d::Zero();
  velocity << 0.0, 3.0, 4.0, 0.0, 0.1, 0.0;
  expectDeviations(travelCovariance(velocity, 2.0, 70.0), 5.0 * 2.0 + 0.5 * 5.0 * 4.0, M_PI);
  expectDeviations(travelCovariance(velocity, 1.0, 6.0), 6.0, 0.1 + 1.0);
}

TEST(MotionCovariances, ADisagreementIsAsLargeInEveryDirection) {
  Vector6d difference = Vector6d::Zero();
  difference << 0.3, 0.0, 0.4, 0.0, 0.02, 0.0;
  Vector6d start = Vector6d::Constant(0.1);
  expectDeviations(disagreement(expSE3(start), expSE3(start) * expSE3(difference)), 0.5, 0.02);
}

constexpr std::int64_t kSecond = 1000000000;  // ns

Vector6d ahead(double speed) {
  Vector6d velocity = Vector6d::Zero();
  velocity[2] = speed;
  return velocity;
}

TEST(MotionBelief, PredictsTheLastVelocity) {
  MotionBelief belief;
  EXPECT_FALSE(belief.velocity());
  EXPECT_TRUE(belief.expected(0.1).isApprox(Eigen::Isometry3d::Identity()));
  belief.measure(kSecond, ahead(3.0), 0.1, Matrix6d::Identity() * 1e-4, true);
  EXPECT_NEAR(belief.predicted(0.2).translation().z(), 0.6, 1e-12);
  EXPECT_NEAR(belief.expected(0.2).translation().z(), 0.6, 1e-12);
  // The velocity is known to 0.01 m in 0.1 s, and may change by 5 m/s^2 times 0.2 s.
  EXPECT_NEAR(belief.predictedCovariance(0.2)(2, 2), 4.0 * 1e-4 + 0.2 * 0.2, 1e-12);
}

TEST(MotionBelief, APredictionWithinABurstIsAsUncertainAsTheIntervalBefore) {
  MotionBelief belief;
  belief.measure(kSecond, ahead(3.0), 0.1, Matrix6d::Zero(), true);
  belief.pass(0.1);
  belief.pass(0.001);
  EXPECT_NEAR(belief.predictedCovariance(0.001)(2, 2), std::pow(5.0 * 0.08 * 0.08, 2) + std::pow(3.0 * 0.079, 2),
              1e-12);
  for (int i = 0; i < 100; ++i) belief.pass(0.001);
  EXPECT_LT(belief.predictedCovariance(0.001)(2, 2), 1e-9);
}

TEST(MotionBelief, WhatIsInDoubtReplacesATrustedVelocityOnlyOnceThatIsOld) {
  MotionBelief belief;
  belief.measure(kSecond, ahead(3.0), 0.1, Matrix6d::Zero(), true);
  belief.measure(2 * kSecond, ahead(9.0), 0.1, Matrix6d::Zero(), false);
  EXPECT_EQ(*belief.velocity(), ahead(9.0));
  EXPECT_EQ(*belief.trusted(), ahead(3.0));
  EXPECT_DOUBLE_EQ(belief.trustedAge(2 * kSecond), 1.0);
  belief.measure(4 * kSecond, ahead(9.0), 0.1, Matrix6d::Zero(), false);
  EXPECT_EQ(*belief.trusted(), ahead(9.0));
}

TEST(MotionBelief, ADoubtedMotionPredictsBadly) {
  MotionBelief belief;
  belief.measure(kSecond, ahead(3.0), 0.1, Matrix6d::Zero(), true);
  const Matrix6d before = belief.predictedCovariance(0.1);
  belief.doubt(Matrix6d::Identity());
  EXPECT_TRUE(belief.predictedCovariance(0.1).isApprox(before + Matrix6d::Identity(), 1e-12));
}

TEST(MotionBelief, AnInterruptionLeavesTheTrustedVelocity) {
  MotionBelief belief;
  belief.measure(kSecond, ahead(3.0), 0.1, Matrix6d::Zero(), true);
  belief.interrupt();
  EXPECT_FALSE(belief.velocity());
  EXPECT_TRUE(belief.trusted());
  belief.forget();
  EXPECT_FALSE(belief.trusted());
}

}  // namespace test_motion_belief
}  // namespace sdvo
