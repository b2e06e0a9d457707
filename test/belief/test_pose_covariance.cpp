#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "../../src/belief/pose_covariance.hpp"

namespace sdvo::test_pose_covariance {

constexpr double kForward = 2.0;  // m
const Eigen::Isometry3d kStill = Eigen::Isometry3d::Identity();

Eigen::Isometry3d forward() {
  return Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, kForward));
}

Matrix6d diagonal(double translation, double rotation) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  return variance.asDiagonal();
}

/// Such a covariance after driving forward: a turn about y, before the drive, moves its end by +L along x; one about x
/// by -L along y.
Matrix6d afterForward(double translation, double rotation, double way = kForward) {
  Matrix6d covariance = diagonal(translation, rotation);
  covariance(0, 0) += way * way * rotation;
  covariance(1, 1) += way * way * rotation;
  covariance(0, 4) = covariance(4, 0) = way * rotation;
  covariance(1, 3) = covariance(3, 1) = -way * rotation;
  return covariance;
}

void expectEqual(const Matrix6d& actual, const Matrix6d& expected) {
  EXPECT_LT((actual - expected).cwiseAbs().maxCoeff(), 1e-12) << actual << "\n\nexpected\n" << expected;
}

/// No less in any direction.
void expectCovers(const Matrix6d& actual, const Matrix6d& least) {
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(actual - least).eigenvalues().minCoeff(), -1e-12) << actual;
}

TEST(PoseCovariance, AddsMotionsThatAreKnownByThemselves) {
  PoseCovariance covariance;
  expectEqual(covariance.value(), Matrix6d::Zero());
  covariance.predict(forward(), diagonal(0.5, 0.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
  covariance.predict(forward(), diagonal(0.125, 0.0));
  expectEqual(covariance.value(), afterForward(0.5, 0.25) + diagonal(0.125, 0.0));
}

TEST(PoseCovariance, DoesNotGrowBetweenPairsMeasuredFromOneKeyframe) {
  PoseCovariance covariance;
  expectEqual(covariance.update(kStill, diagonal(0.5, 0.25)), diagonal(0.5, 0.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
  expectEqual(covariance.update(kStill, diagonal(0.75, 0.25)), diagonal(0.75, 0.25));
  expectEqual(covariance.value(), diagonal(0.75, 0.25));
  // A better pose does not take back what was reported.
  covariance.update(kStill, diagonal(0.125, 0.125));
  expectEqual(covariance.value(), diagonal(0.75, 0.25));
}

TEST(PoseCovariance, AMotionIsThatOfTheLastTwoPosesToEachOther) {
  // Along a line: the key frame errs by `common`, a pair by its own error against it. A weak pair, then a good one.
  constexpr double kCommon = 1.0, kWeak = 9.0, kGood = 1.0;
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(kCommon + kWeak, 0.25));
  Matrix6d motion = covariance.update(kStill, diagonal(kCommon + kGood, 0.25));
  EXPECT_NEAR(motion(0, 0), kWeak + kGood, 1e-9) << "both pairs' own errors, not the key frame's";
  motion = covariance.update(kStill, diagonal(kCommon + kGood, 0.25));
  EXPECT_NEAR(motion(0, 0), kGood + kGood, 1e-9) << "the weak pair has no part in it";
  // Where the pair before is the key frame, its error is what the new one is measured against.
  covariance.update(kStill, diagonal(kCommon + kWeak, 0.25));
  covariance.markKeyframe();
  motion = covariance.update(kStill, diagonal(kCommon + kGood, 0.25));
  EXPECT_NEAR(motion(0, 0), kCommon + kGood, 1e-9);
}

TEST(PoseCovariance, AMotionIsAsUncertainInEachDirectionAsTheWorseOfTheTwoPoses) {
  PoseCovariance covariance;
  Matrix6d sideways = diagonal(0.1, 0.01), ahead = sideways;
  sideways(0, 0) = 0.9, ahead(2, 2) = 0.9;
  covariance.update(kStill, sideways);
  Matrix6d both = sideways;
  both(2, 2) = 0.9;
  expectEqual(covariance.update(kStill, ahead), both);
}

TEST(PoseCovariance, ContainsWhatASecondThoughtMoved) {
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(0.0001, 0.0001));
  Vector6d correction = Vector6d::Zero();
  correction[0] = 0.015;
  covariance.coverCorrection(correction);
  expectEqual(covariance.value(), diagonal(0.0001, 0.0001));  // one and a half standard deviations are expected
  correction[0] = 0.02;
  covariance.coverCorrection(correction);
  // All of the correction along itself, and 3 % of it in each direction.
  Matrix6d added = Matrix6d::Zero();
  const auto add = [&](double square) {
    added(0, 0) += square;
    added.topLeftCorner<3, 3>().diagonal().array() += 9e-4 * square;
  };
  add(0.0004);
  expectEqual(covariance.value(), diagonal(0.0001, 0.0001) + added);
  correction[0] = 0.5;
  covariance.coverCorrection(correction);
  add(0.25);
  expectEqual(covariance.value(), diagonal(0.0001, 0.0001) + added);
  covariance.coverCorrection(correction);
  expectEqual(covariance.value(), diagonal(0.0001, 0.0001) + added);
  // What is measured from the same key frame later has that error, too.
  covariance.update(kStill, diagonal(1.0, 1.0));
  expectEqual(covariance.value(), diagonal(1.0, 1.0) + added);
}

TEST(PoseCovariance, GrowsFromKeyframeToKeyframe) {
  PoseCovariance covariance;
  covariance.update(forward(), diagonal(0.5, 0.25));
  covariance.markKeyframe();
  const double translation = 0.5, rotation = 0.25;
  expectEqual(covariance.value(), diagonal(translation, rotation));
  covariance.update(forward(), diagonal(0.125, 0.0));
  expectEqual(covariance.value(), afterForward(translation, rotation) + diagonal(0.125, 0.0));
  // Still from that key frame, which is now two steps behind.
  covariance.update(forward(), diagonal(0.25, 0.0));
  Matrix6d expected = diagonal(translation + 0.25, rotation);
  for (const int axis : {0, 1}) expected(axis, axis) += 4.0 * kForward * kForward * rotation;
  expected(0, 4) = expected(4, 0) = 2.0 * kForward * rotation;
  expected(1, 3) = expected(3, 1) = -2.0 * kForward * rotation;
  expectEqual(covariance.value(), expected);
}

TEST(PoseCovariance, APredictedPairAddsToTheNextOnesMotion) {
  for (const bool from_keyframe : {false, true}) {
    PoseCovariance covariance;
    covariance.update(forward(), diagonal(0.5, 0.25));
    if (from_keyframe) covariance.markKeyframe();
    covariance.predict(forward(), diagonal(8.0, 2.0));
    const Matrix6d predicted = afterForward(0.5, 0.25) + diagonal(8.0, 2.0);
    expectEqual(covariance.value(), predicted);
    const Matrix6d motion = covariance.update(forward(), diagonal(0.75, 0.25)) - afterForward(8.0, 2.0);
    if (from_keyframe) {
      expectEqual(motion, diagonal(0.75, 0.25));
    } else {
      // The last measured pose's own, two motions ago: its turn has moved the camera by twice as much.
      expectCovers(motion, diagonal(0.75, 0.25));
      expectCovers(motion, afterForward(0.5, 0.25, 2.0 * kForward));
    }
    // Only once.
    const Matrix6d next = covariance.update(forward(), diagonal(0.75, 0.25));
    expectCovers(next, afterForward(0.75, 0.25));
    EXPECT_LT(next.trace(), 2.0 * afterForward(0.75, 0.25).trace());
  }
}

TEST(PoseCovariance, APredictionEndsWithTheNextMeasuredPose) {
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(0.5, 0.25));
  for (int i = 0; i < 1000; ++i) covariance.predict(kStill, diagonal(8.0, 2.0));
  covariance.update(kStill, diagonal(0.5, 0.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
}

TEST(PoseCovariance, AKeyframeThatWasDoubtedLeavesNoDoubtToThePosesMeasuredInItsMap) {
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(0.5, 0.25));
  covariance.addDoubt(diagonal(8.0, 2.0), diagonal(8.0, 2.0));
  covariance.markKeyframe();
  expectEqual(covariance.value(), diagonal(8.5, 2.25));
  const Matrix6d motion = covariance.update(kStill, diagonal(0.125, 0.125));
  expectEqual(motion, diagonal(8.125, 2.125));
  expectEqual(covariance.value(), diagonal(0.625, 0.375));
}

TEST(PoseCovariance, AnAssumedPoseIsTheKeyFrameOfANewDrive) {
  PoseCovariance covariance;
  covariance.update(forward(), diagonal(0.5, 0.25));
  covariance.addDoubt(diagonal(1.0, 1.0), diagonal(1.0, 1.0));
  covariance.reset(covariance.value() + diagonal(100.0, 0.25));
  expectEqual(covariance.value(), diagonal(101.5, 1.5));
  // Neither the measurement nor the doubt before the gap has a part in the first motion after it.
  expectEqual(covariance.update(forward(), diagonal(0.125, 0.0)), diagonal(0.125, 0.0));
  expectEqual(covariance.value(), afterForward(101.5, 1.5) + diagonal(0.125, 0.0));
}

TEST(PoseCovariance, ADoubtedPoseIsReportedSoUntilTheNextOneIsMeasured) {
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(0.5, 0.25));
  covariance.addDoubt(diagonal(8.0, 2.0), diagonal(16.0, 4.0));
  expectEqual(covariance.value(), diagonal(16.5, 4.25));
  expectEqual(covariance.update(kStill, diagonal(0.5, 0.25)), diagonal(8.5, 2.25));
  expectEqual(covariance.value(), diagonal(0.5, 0.25));
}

TEST(PoseCovariance, RotationDoesNotFallWhereTranslationGrows) {
  PoseCovariance covariance;
  covariance.update(kStill, diagonal(0.5, 0.25));
  covariance.update(kStill, diagonal(0.5, 2.25));
  covariance.update(kStill, diagonal(9.0, 0.5));
  expectEqual(covariance.value(), diagonal(9.0, 2.25));
  covariance.update(kStill, diagonal(4.0, 3.0));
  expectEqual(covariance.value(), diagonal(9.0, 3.0));
}

TEST(PoseCovariance, StaysSymmetricAndPositive) {
  PoseCovariance covariance;
  const Eigen::Isometry3d step = expSE3((Vector6d() << 0.1, -0.05, 1.0, 0.02, -0.3, 0.1).finished());
  for (int i = 0; i < 1000; ++i) {
    const Matrix6d motion = covariance.update(step, diagonal(1e-4, 1e-6) * (1 + i % 7));
    if (i % 3 == 0) covariance.markKeyframe();
    if (i % 11 == 0) covariance.addDoubt(diagonal(1e-2, 1e-4), diagonal(2e-2, 1e-4));
    for (const Matrix6d& matrix : {motion, covariance.value()}) {
      EXPECT_EQ(matrix, matrix.transpose());
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(matrix).eigenvalues().minCoeff(), 0.0) << i;
    }
  }
}

/// Ten steps of 2 m, each of them longer by a part of the rig's error.
PoseCovariance tenSteps(const RigEstimate::Vector& compensated) {
  PoseCovariance covariance;
  RigEstimate::MotionJacobian by_rig = RigEstimate::MotionJacobian::Zero();
  by_rig.row(2) << 0.02, 0.005, 0.4, 3.0;  // m/px, m/px, m/rad, m/s
  for (int step = 0; step < 10; ++step) {
    for (const int pair : {0, 1}) {  // of which the second is the key frame
      covariance.update(pair == 0 ? forward() : kStill, diagonal(1e-4, 0.0));
      covariance.updateExposure(by_rig, RigEstimate(), compensated);
    }
    covariance.markKeyframe();
  }
  return covariance;
}

TEST(PoseCovariance, TheRigsErrorIsFromTheOneThatWasCompensated) {
  const RigEstimate::Vector compensated(0.1, -0.2, 0.01, 0.002);
  RigEstimate known;
  known.mean = compensated;
  EXPECT_LT(tenSteps(compensated).byRig(known).norm(), 1e-20);
  known.mean << 0.3, -0.2, 0.01, 0.002;
  EXPECT_NEAR(std::sqrt(tenSteps(compensated).byRig(known)(2, 2)), 10.0 * 0.02 * 0.2, 1e-12);
}

TEST(PoseCovariance, AMotionHasItsPartOfTheRigsErrorAndAMapThatBeginsKeepsThePoses) {
  PoseCovariance covariance = tenSteps(RigEstimate::Vector::Zero());
  RigEstimate known;
  known.covariance(0, 0) = 0.09;
  RigEstimate::MotionJacobian by_rig = RigEstimate::MotionJacobian::Zero();
  by_rig(2, 0) = 0.02;  // m/px
  const auto step = [&](double pixels) {
    covariance.update(forward(), diagonal(1e-4, 0.0));
    return std::sqrt(covariance.updateExposure(pixels * by_rig, known, RigEstimate::Vector::Zero())(2, 2));
  };
  EXPECT_NEAR(step(1.0), 0.02 * 0.3, 1e-12);
  EXPECT_NEAR(step(3.0), 2.0 * 0.02 * 0.3, 1e-12) << "since the last pose, not since the key frame";
  const Matrix6d before = covariance.value() + covariance.byRig(known);
  covariance.beginMap();
  EXPECT_LT((covariance.value() + covariance.byRig(known) - before).norm(), 1e-12);
  EXPECT_NEAR(step(1.0), 0.02 * 0.3, 1e-12);
  EXPECT_NEAR(std::sqrt(covariance.byRig(known)(2, 2)), 14.0 * 0.02 * 0.3, 1e-12);
}

/// Schmidt's filter in covariance form: a drive whose rig walks, and poses that its mean never corrects.
TEST(PoseCovariance, IsThatOfOneGaussianOfPoseAndRig) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto drawn = [&](auto matrix) {
    return decltype(matrix)(matrix.unaryExpr([&](double) { return normal(random); }));
  };
  RigEstimate known;
  known.covariance.diagonal() << 0.09, 0.25, 1e-4, 1e-6;
  const RigEstimate::Vector step(0.002, 0.001, 1e-6, 1e-8);
  PoseCovariance covariance;
  Matrix6d pose = Matrix6d::Zero();
  Eigen::Matrix<double, 6, RigEstimate::kParameters> cross;
  cross.setZero();
  for (int pair = 0; pair < 20; ++pair) {
    covariance.walkRig(known, RigEstimate::Matrix::Zero());
    covariance.walkRig(known, step.asDiagonal());
    known.covariance += step.asDiagonal();
    const Matrix6d noise = diagonal(1e-4, 1e-6);
    const RigEstimate::MotionJacobian by_rig = 0.01 * drawn(RigEstimate::MotionJacobian());
    const Matrix6d ad = adjoint(forward().inverse());
    pose = (ad * pose * ad.transpose()).eval(), cross = (ad * cross).eval();
    const Matrix6d mixed = by_rig * cross.transpose();
    pose += noise + mixed + mixed.transpose() + by_rig * known.covariance * by_rig.transpose();
    cross += by_rig * known.covariance;
    covariance.update(forward(), noise);
    covariance.updateExposure(by_rig, known, RigEstimate::Vector::Zero());
    covariance.markKeyframe();
    EXPECT_LT((covariance.value() + covariance.byRig(known) - pose).norm(), 1e-9 * pose.norm()) << pair;
  }
  covariance.changeRig(known);
  EXPECT_LT((covariance.value() - pose).norm(), 1e-9 * pose.norm()) << "whatever the next rig is";
  EXPECT_EQ(covariance.byRig(known).norm(), 0.0);
}

}  // namespace sdvo::test_pose_covariance
