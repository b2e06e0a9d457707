#include <gtest/gtest.h>

#include <cmath>

#include "stereo_descriptor_vo/odometry/motion_doubt.hpp"

namespace sdvo {
namespace {

/// A standard deviation of translation and one of rotation, the same in all directions.
void expectDeviations(const Matrix6d& covariance, double translation, double rotation) {
  Vector6d expected;
  expected << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  EXPECT_TRUE(covariance.isDiagonal());
  EXPECT_LT((covariance.diagonal().cwiseSqrt() - expected).norm(), 1e-12) << covariance.diagonal().transpose();
}

TEST(MotionDoubt, APredictionErrsByTheAcceleration) {
  // A body at a constant 5 m/s^2 covers 5 * 0.2^2 m more in each interval of 0.2 s than in the one before.
  expectDeviations(predictionCovariance(0.2), 5.0 * 0.04, 2.0 * 0.04);
}

TEST(MotionDoubt, UnseenTravelIsBoundedByTheSpeedAndByATurn) {
  Vector6d velocity = Vector6d::Zero();
  velocity << 0.0, 3.0, 4.0, 0.0, 0.1, 0.0;
  expectDeviations(travelCovariance(velocity, 2.0, 70.0), 5.0 * 2.0 + 0.5 * 5.0 * 4.0, M_PI);
  expectDeviations(travelCovariance(velocity, 1.0, 6.0), 6.0, 0.1 + 1.0);
}

TEST(MotionDoubt, ADisagreementIsAsLargeInEveryDirection) {
  Vector6d difference = Vector6d::Zero();
  difference << 0.3, 0.0, 0.4, 0.0, 0.02, 0.0;
  Vector6d start = Vector6d::Constant(0.1);
  expectDeviations(disagreement(expSE3(start), expSE3(start) * expSE3(difference)), 0.5, 0.02);
}

}  // namespace
}  // namespace sdvo
