#include <gtest/gtest.h>

#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"

namespace sdvo {
namespace test_pose_verdict {

constexpr int kMinInliers = 12;

/// A motion of 1 m ahead in 0.1 s that nothing speaks against.
PoseEvidence soundEvidence() {
  PoseEvidence evidence;
  evidence.matches = 500, evidence.inliers = 350;
  evidence.lasting_matches = 200, evidence.lasting_inliers = 180;
  evidence.motion.translation().z() = 1.0;
  evidence.dt = 0.1;
  Vector6d velocity = Vector6d::Zero();
  velocity[2] = 10.0;
  evidence.velocity = velocity;
  return evidence;
}

Trust trustIn(const PoseEvidence& evidence, const PoseVerdictOptions& options = {}) {
  const PoseVerdict verdict = judgePose(options, kMinInliers, evidence);
  EXPECT_EQ(verdict.reason.empty(), verdict.trust == Trust::kSound) << verdict.reason;
  return verdict.trust;
}

TEST(PoseVerdict, NothingSpeaksAgainstASoundMotion) {
  EXPECT_EQ(trustIn(soundEvidence()), Trust::kSound);
  PoseEvidence evidence = soundEvidence();
  evidence.velocity.reset();
  evidence.lasting_matches = evidence.lasting_inliers = 0;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
}

TEST(PoseVerdict, TooFewInliersAreNoMotion) {
  PoseEvidence evidence = soundEvidence();
  evidence.matches = 30;
  evidence.inliers = kMinInliers;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.inliers = kMinInliers - 1;
  EXPECT_EQ(trustIn(evidence), Trust::kNone);
}

TEST(PoseVerdict, AShareThatChanceGivesIsNoMotion) {
  PoseEvidence evidence = soundEvidence();
  evidence.inliers = 67;  // 0.4 / 3 of 500
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.inliers = 66;
  EXPECT_EQ(trustIn(evidence), Trust::kNone);
  evidence.matches = 0, evidence.inliers = kMinInliers;
  EXPECT_EQ(trustIn(evidence), Trust::kNone);
}

TEST(PoseVerdict, FewInliersAreDoubted) {
  PoseEvidence evidence = soundEvidence();
  evidence.inliers = 40, evidence.matches = 60;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.inliers = 39;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.inliers = 200, evidence.matches = 500;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.inliers = 199;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
}

TEST(PoseVerdict, LastingPointsThatDisagreeAreDoubted) {
  PoseEvidence evidence = soundEvidence();
  evidence.lasting_inliers = 100;  // 0.5 of 200
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.lasting_inliers = 99;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.lasting_matches = 19, evidence.lasting_inliers = 0;  // too few to say anything
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
}

TEST(PoseVerdict, SpeedsAndRatesHaveLimits) {
  PoseEvidence evidence = soundEvidence();
  evidence.velocity.reset();
  evidence.motion.translation().z() = 70.0 * 0.12 - 0.01;  // dt and the stamps' tolerance
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.motion.translation().z() = 70.0 * 0.12 + 0.01;
  EXPECT_EQ(trustIn(evidence), Trust::kNone);
  evidence.motion = Eigen::AngleAxisd(6.3 * 0.12 - 0.001, Eigen::Vector3d::UnitY());
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.motion = Eigen::AngleAxisd(6.3 * 0.12 + 0.001, Eigen::Vector3d::UnitY());
  EXPECT_EQ(trustIn(evidence), Trust::kNone);
}

TEST(PoseVerdict, NoiseOverATinyTimeIsNoRate) {
  PoseVerdictOptions options;
  options.stamp_tolerance = 0.0;
  PoseEvidence evidence = soundEvidence();
  evidence.velocity.reset();
  evidence.dt = 0.001;
  evidence.motion = Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX());  // 10 rad/s
  EXPECT_EQ(trustIn(evidence, options), Trust::kNone);
  evidence.covariance.diagonal().tail<3>() << 0.9e-6, 0.05e-6, 0.05e-6;  // 1 mrad in all: five are 5 mrad
  EXPECT_EQ(trustIn(evidence, options), Trust::kSound);
  evidence.covariance.setZero();
  options.stamp_tolerance = 0.02;
  EXPECT_EQ(trustIn(evidence, options), Trust::kSound);
}

TEST(PoseVerdict, WhatAnotherSourceSaysTooIsNotImplausible) {
  PoseEvidence evidence = soundEvidence();
  evidence.motion.linear() = expSO3({0.0, 0.5, 0.0});
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.guess = evidence.motion;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.guess->linear() = expSO3({0.0, -0.5, 0.0});
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.motion.linear().setIdentity();
  EXPECT_EQ(trustIn(evidence), Trust::kSound) << "a wrong guess is no evidence against a motion";
}

TEST(PoseVerdict, WhatIsLongAgoMayHaveChangedSince) {
  PoseEvidence evidence = soundEvidence();
  evidence.velocity_age = 0.5;
  const double allowed = (20.0 * 0.12 + 5.0 * 0.5) * 0.12 + 10.0 * 0.04;
  evidence.motion.translation().z() = 1.0 - allowed + 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.motion.translation().z() = 1.0 - allowed - 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  EXPECT_TRUE(judgeChange({}, evidence).of_rate);
  evidence.motion = soundEvidence().motion;
  evidence.motion.linear() = expSO3({0.0, (30.0 * 0.12 + 2.0 * 0.5) * 0.12 + 0.001, 0.0});
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
}

TEST(PoseVerdict, AccelerationsAreJudgedAgainstTheVelocityBefore) {
  PoseEvidence evidence = soundEvidence();
  const double allowed = 20.0 * 0.12 * 0.12 + 10.0 * 0.04;  // max_acceleration and what the stamps may do
  evidence.motion.translation().z() = 1.0 - allowed + 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.motion.translation().z() = 1.0 - allowed - 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
  evidence.motion = soundEvidence().motion;
  evidence.motion.linear() = expSO3({0.0, 30.0 * 0.12 * 0.12 + 0.001, 0.0});
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
}

TEST(PoseVerdict, AWayThatIsKnownBadlyIsDoubted) {
  PoseEvidence evidence = soundEvidence();
  evidence.distance = 2.0;  // from the last key frame, of which this pair's motion is a part
  evidence.deviation = 0.05 + 0.03 * 2.0 - 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kSound);
  evidence.deviation = 0.05 + 0.03 * 2.0 + 0.001;
  EXPECT_EQ(trustIn(evidence), Trust::kDoubtful);
}

TEST(PoseVerdict, AChangeIsUnexpectedBeyondALastingAcceleration) {
  PoseEvidence evidence = soundEvidence();
  evidence.velocity_age = 0.5;
  const double allowed = 5.0 * (0.5 + evidence.dt) * evidence.dt;
  evidence.motion.translation().z() = 1.0 + allowed - 0.001;
  EXPECT_FALSE(isUnexpected(evidence));
  evidence.motion.translation().z() = 1.0 + allowed + 0.001;
  EXPECT_TRUE(isUnexpected(evidence));
  evidence.motion.translation().z() = 1.0;
  const double turn = 2.0 * (evidence.velocity_age + 0.1) * 0.1;  // rad/s^2, over the age, for one pair
  evidence.motion.linear() = expSO3({0.0, turn - 0.001, 0.0});
  EXPECT_FALSE(isUnexpected(evidence));
  evidence.motion.linear() = expSO3({0.0, turn + 0.001, 0.0});
  EXPECT_TRUE(isUnexpected(evidence));
  evidence.velocity.reset();
  EXPECT_FALSE(isUnexpected(evidence)) << "nothing was expected";
}

TEST(PoseVerdict, TellsADoubtOfTheRateFromOneOfTheWay) {
  PoseEvidence evidence = soundEvidence();
  evidence.motion.translation().z() = 3.0;  // 30 m/s after 10 m/s
  EXPECT_TRUE(judgePose({}, 12, evidence).of_rate);
  evidence.lasting_matches = 100, evidence.lasting_inliers = 10;
  const PoseVerdict verdict = judgePose({}, 12, evidence);
  EXPECT_EQ(verdict.trust, Trust::kDoubtful);
  EXPECT_FALSE(verdict.of_rate);
  EXPECT_FALSE(judgePose({}, 12, soundEvidence()).of_rate);
}

TEST(PoseVerdict, LastingPointsAgreeOrDisagreeOrAreTooFew) {
  const auto say = [&](int matches, int inliers) {
    const PoseVerdictOptions options;
    PoseEvidence evidence;
    evidence.lasting_matches = matches, evidence.lasting_inliers = inliers;
    const bool agree = lastingAgree(options, evidence), disagree = lastingDisagree(options, evidence);
    EXPECT_FALSE(agree && disagree);
    return agree - disagree;
  };
  EXPECT_EQ(say(20, 9), -1);
  EXPECT_EQ(say(20, 10), 1) << "tracking/doubtful_lasting_ratio is a half";
  EXPECT_EQ(say(19, 0), 0);
  EXPECT_EQ(say(19, 19), 0);
}

}  // namespace test_pose_verdict
}  // namespace sdvo
