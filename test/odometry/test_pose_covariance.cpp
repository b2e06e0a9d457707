#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "stereo_descriptor_vo/odometry/pose_covariance.hpp"

namespace sdvo {
namespace {

constexpr double kForward = 2.0;  // m

Eigen::Isometry3d forward() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = kForward;
  return T;
}

Matrix6d diagonal(double translation, double rotation) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  return variance.asDiagonal();
}

/// Such a covariance after driving forward: a turn about y, before the drive, moves its end by +L along x; one about x
/// by -L along y.
Matrix6d afterForward(double translation, double rotation) {
  Matrix6d covariance = diagonal(translation, rotation);
  covariance(0, 0) += kForward * kForward * rotation;
  covariance(1, 1) += kForward * kForward * rotation;
  covariance(0, 4) = covariance(4, 0) = kForward * rotation;
  covariance(1, 3) = covariance(3, 1) = -kForward * rotation;
  return covariance;
}

WindowCovariances window(int first_id, const Matrix6d& since_keyframe) {
  WindowCovariances covariances;
  covariances.first_id = first_id;
  covariances.since_keyframe = since_keyframe;
  return covariances;
}

void expectEqual(const Matrix6d& actual, const Matrix6d& expected) {
  EXPECT_LT((actual - expected).cwiseAbs().maxCoeff(), 1e-12) << actual << "\n\nexpected\n" << expected;
}

TEST(PoseCovariance, BeginsAtZero) {
  expectEqual(PoseCovariance().value(), Matrix6d::Zero());
}

TEST(PoseCovariance, AddsMotionsThatAreKnownByThemselves) {
  PoseCovariance covariance;
  covariance.advance(forward(), diagonal(0.5, 0.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
  covariance.advance(forward(), diagonal(0.125, 0.0));
  expectEqual(covariance.value(), afterForward(0.5, 0.25) + diagonal(0.125, 0.0));
}

TEST(PoseCovariance, DoesNotGrowBetweenPairsMeasuredFromOneKeyframe) {
  PoseCovariance covariance;
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  expectEqual(covariance.advance(still, window(1, diagonal(0.5, 0.25))), diagonal(0.5, 0.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
  // The motion is between two poses, each known as well as the key frame tells.
  expectEqual(covariance.advance(still, window(1, diagonal(0.75, 0.25))), diagonal(1.25, 0.5));
  expectEqual(covariance.value(), diagonal(0.75, 0.25));
  // A better pose does not take back what was reported.
  expectEqual(covariance.advance(still, window(1, diagonal(0.125, 0.125))), diagonal(0.875, 0.375));
  expectEqual(covariance.value(), diagonal(0.75, 0.25));
}

TEST(PoseCovariance, ContainsWhatASecondThoughtMoved) {
  PoseCovariance covariance;
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  covariance.advance(still, window(1, diagonal(0.0001, 0.0001)));
  Vector6d correction = Vector6d::Zero();
  correction[0] = 0.015;
  covariance.cover(correction);
  expectEqual(covariance.value(), diagonal(0.0001, 0.0001));  // one and a half standard deviations are expected
  correction[0] = 0.02;
  covariance.cover(correction);
  Matrix6d expected = diagonal(0.0001, 0.0001);
  expected(0, 0) += 0.0004;
  expectEqual(covariance.value(), expected);
  correction[0] = 0.5;
  covariance.cover(correction);
  expected(0, 0) += 0.25;
  expectEqual(covariance.value(), expected);
  covariance.cover(correction);
  expectEqual(covariance.value(), expected);
  // What is measured from the same key frame later has that error, too.
  covariance.advance(still, window(1, diagonal(1.0, 1.0)));
  Matrix6d later = diagonal(1.0, 1.0);
  later(0, 0) += 0.2504;
  expectEqual(covariance.value(), later);
}

TEST(PoseCovariance, CarriesWhatEarlierPosesLackedIntoTheNewOne) {
  PoseCovariance covariance;
  covariance.advance(forward(), window(1, diagonal(0.5, 0.25)));
  expectEqual(covariance.advance(forward(), window(1, diagonal(9.0, 9.0))),
              afterForward(0.5, 0.25) + diagonal(9.0, 9.0));
}

TEST(PoseCovariance, GrowsFromKeyframeToKeyframe) {
  PoseCovariance covariance;
  covariance.advance(forward(), window(1, diagonal(0.5, 0.25)));
  covariance.markKeyframe();
  const double translation = PoseCovariance::kAlike * 0.5, rotation = PoseCovariance::kAlike * 0.25;
  expectEqual(covariance.value(), diagonal(translation, rotation));
  covariance.advance(forward(), window(1, diagonal(0.125, 0.0)));
  expectEqual(covariance.value(), afterForward(translation, rotation) + diagonal(0.125, 0.0));
  // Still from that key frame, which is now two steps behind.
  covariance.advance(forward(), window(1, diagonal(0.25, 0.0)));
  Matrix6d expected = diagonal(translation + 0.25, rotation);
  for (const int axis : {0, 1}) expected(axis, axis) += 4.0 * kForward * kForward * rotation;
  expected(0, 4) = expected(4, 0) = 2.0 * kForward * rotation;
  expected(1, 3) = expected(3, 1) = -2.0 * kForward * rotation;
  expectEqual(covariance.value(), expected);
}

TEST(PoseCovariance, AKeyframeLackedWhatItsOwnWindowKnewLess) {
  for (const bool slid : {false, true}) {
    PoseCovariance covariance;
    WindowCovariances then = window(1, diagonal(4.0, 4.0));
    then.since_first = diagonal(3.0, 1.0);
    then.since_second = diagonal(2.5, 0.5);
    covariance.advance(forward(), then);
    covariance.markKeyframe();
    WindowCovariances now = window(slid ? 2 : 1, diagonal(0.125, 0.0));
    now.keyframe_since_first = diagonal(2.0, 0.75);
    // In rotation the second window knows less than the first did from the second frame on: nothing was lacking.
    expectEqual(covariance.advance(forward(), now),
                (slid ? afterForward(0.5, 0.0) : afterForward(1.0, 0.25)) + diagonal(0.125, 0.0));
  }
}

TEST(PoseCovariance, APredictedPairAddsToTheNextOnesMotion) {
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  for (const bool from_keyframe : {false, true}) {
    PoseCovariance covariance;
    covariance.advance(still, window(1, diagonal(0.5, 0.25)));
    if (from_keyframe) covariance.markKeyframe();
    const Matrix6d before = covariance.value();
    covariance.advance(still, diagonal(8.0, 2.0));
    expectEqual(covariance.value(), before + diagonal(8.0, 2.0));
    const Matrix6d lacked = from_keyframe ? diagonal(8.0, 2.0) : diagonal(8.5, 2.25);
    expectEqual(covariance.advance(still, window(1, diagonal(0.75, 0.25))), lacked + diagonal(0.75, 0.25));
    expectEqual(covariance.value(), before + diagonal(8.0, 2.0));
  }
}

TEST(PoseCovariance, AKeyframeThatNoWindowMeasuredLackedAllSinceTheOneBefore) {
  PoseCovariance covariance;
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  covariance.advance(still, window(1, diagonal(0.5, 0.25)));
  covariance.advance(still, diagonal(8.0, 2.0));
  covariance.markKeyframe();
  expectEqual(covariance.advance(still, window(1, diagonal(0.125, 0.125))), diagonal(8.625, 2.375));
}

TEST(PoseCovariance, RestartsFromTheLastPoseWithMetresAndAGoodPartOfARightAngle) {
  PoseCovariance covariance;
  WindowCovariances before = window(1, diagonal(0.5, 0.25));
  before.since_first = before.since_second = diagonal(0.5, 0.25);
  covariance.advance(forward(), before);
  covariance.restart();
  expectEqual(covariance.value(), diagonal(100.5, 0.5));
  // The window before the gap has no part in the first motion after it.
  expectEqual(covariance.advance(forward(), window(7, diagonal(0.125, 0.0))), diagonal(0.125, 0.0));
  expectEqual(covariance.value(), afterForward(100.5, 0.5) + diagonal(0.125, 0.0));
}

TEST(PoseCovariance, WhatMayHaveBeenTravelledUnseenIsAddedAtARestart) {
  PoseCovariance covariance;
  covariance.restart(diagonal(4.0, 1.0));
  expectEqual(covariance.value(), diagonal(104.0, 1.25));
}

TEST(PoseCovariance, ADoubtedPoseIsReportedSoAndTheNextMotionContainsTheDoubt) {
  PoseCovariance covariance;
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  WindowCovariances measured = window(1, diagonal(0.5, 0.25));
  covariance.advance(still, measured);
  covariance.doubt(diagonal(8.0, 2.0));
  expectEqual(covariance.value(), diagonal(8.5, 2.25));
  expectEqual(covariance.advance(still, measured), diagonal(9.0, 2.5));
  // What was reported stays true.
  expectEqual(covariance.value(), diagonal(8.5, 2.25));
}

TEST(PoseCovariance, RotationDoesNotFallWhereTranslationGrows) {
  PoseCovariance covariance;
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  covariance.advance(still, window(1, diagonal(0.5, 0.25)));
  covariance.doubt(diagonal(0.0, 2.0));
  covariance.advance(still, window(1, diagonal(9.0, 0.5)));
  expectEqual(covariance.value(), diagonal(9.0, 2.25));
  covariance.advance(still, window(1, diagonal(4.0, 3.0)));
  expectEqual(covariance.value(), diagonal(9.0, 3.0));
}

TEST(PoseCovariance, StaysSymmetricAndPositive) {
  PoseCovariance covariance;
  Vector6d step;
  step << 0.1, -0.05, 1.0, 0.02, -0.3, 0.1;
  for (int i = 0; i < 1000; ++i) {
    WindowCovariances measured = window(i / 10, diagonal(1e-4, 1e-6) * (1 + i % 7));
    measured.since_first = measured.since_second = 2.0 * measured.since_keyframe;
    measured.keyframe_since_first = measured.since_keyframe;
    const Matrix6d motion = covariance.advance(expSE3(step), measured);
    if (i % 3 == 0) covariance.markKeyframe();
    for (const Matrix6d& matrix : {motion, covariance.value()}) {
      EXPECT_EQ(matrix, matrix.transpose());
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(matrix).eigenvalues().minCoeff(), 0.0) << i;
    }
  }
}

TEST(WindowCovariances, OnlyTheNewestFrameIsInflated) {
  WindowCovariances window;
  window.since_keyframe = window.since_first = window.since_second = window.keyframe_since_first = Matrix6d::Identity();
  window.inflateNewest(3.0);
  for (const Matrix6d& covariance : {window.since_keyframe, window.since_first, window.since_second})
    EXPECT_TRUE(covariance.isApprox(3.0 * Matrix6d::Identity()));
  EXPECT_TRUE(window.keyframe_since_first.isApprox(Matrix6d::Identity()));
}

}  // namespace
}  // namespace sdvo
