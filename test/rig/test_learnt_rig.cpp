#include <gtest/gtest.h>

#include "../../src/rig/learnt_rig.hpp"
#include "../said.hpp"
#include "turned_grid.hpp"

namespace sdvo::test_learnt_rig {

RotationHypothesis shown(const LearntRig& rig, const StereoFeatures& features,
                         const Eigen::Vector3d& turn = Eigen::Vector3d::Zero()) {
  return rig.rotationHypothesis(features, MotionHypothesis(), Eigen::Vector3d::Zero(), turn * turn.transpose(), 0.1);
}

void learn(LearntRig& rig, const StereoFeatures& features, int pairs = 1) {
  for (int k = 0; k < pairs; ++k) rig.learn(features, nullptr, {}, shown(rig, features), true);
}

LearntRig steady(const StereoFeatures& features) {
  LearntRig rig({}, {});
  learn(rig, features, 20);
  return rig;
}

TEST(LearntRig, AKnockOfTheRightCameraIsOneRotation) {
  const Eigen::Vector3d knock(0.0, 0.0, 6e-3);
  const StereoFeatures before = gridSeenWith({0.3e-3, 0.0, -0.5e-3}), turned = gridSeenWith({0.3e-3, 0.0, 5.5e-3});
  LearntRig rig = steady(before);
  EXPECT_LT(shown(rig, before).log_odds, logOdds(0.05));
  const RotationHypothesis rotation = shown(rig, turned);
  EXPECT_GT(rotation.log_odds, 0.0);
  EXPECT_LT((rotation.value - knock).norm(), 0.2e-3);
  EXPECT_TRUE(contains(rotation.words(), "0.34 degrees")) << rotation.words();
  rig.rotate(rotation, turned.camera);
  EXPECT_LT(shown(rig, rotatedBack(turned, rig.rotation)).log_odds, logOdds(0.05)) << "it is compensated";
}

TEST(LearntRig, ARotationOfOnePairIsTakenBack) {
  const StereoFeatures before = gridSeenWith(Eigen::Vector3d::Zero()), turned = gridSeenWith({0.0, 0.0, 6e-3});
  LearntRig rig = steady(before);
  rig.rotate(shown(rig, turned), before.camera);
  const RotationHypothesis back = shown(rig, rotatedBack(before, rig.rotation));
  ASSERT_GT(back.log_odds, 0.0) << "a return is a rotation";
  rig.rotate(back, before.camera);
  EXPECT_TRUE(rig.rotation.isZero() && rig.rotation_covariance.isZero());
  EXPECT_LT(shown(rig, turned).log_odds, 0.0) << "what came back is what this rig does";
  MotionHypothesis disagreeing;
  disagreeing.agreement.matches = 100;
  rig.learn(before, nullptr, disagreeing, back, false);
  rig.learn(before, nullptr, disagreeing, {}, false);
  EXPECT_TRUE(rig.rotation.isZero()) << "it does not come again";
}

/// The right image was of another moment: the rig is as before, whatever follows. A dark pair says nothing of it.
TEST(LearntRig, ARotationWhoseNextPairAgreesOnNoMotionIsTakenBack) {
  const StereoFeatures before = gridSeenWith(Eigen::Vector3d::Zero()), turned = gridSeenWith({0.0, 0.0, 6e-3});
  const MeasuredPair measured{turned, 0.1, Eigen::Isometry3d::Identity(), 0.1, {}};
  MotionHypothesis disagreeing, dark;
  disagreeing.agreement.matches = 100;
  struct Case {
    const MeasuredPair* next;
    const MotionHypothesis& found;
    bool is_taken_back;
  };
  for (const Case& c : {Case{&measured, disagreeing, false}, {nullptr, disagreeing, true}, {nullptr, dark, false}}) {
    LearntRig rig = steady(before);
    const RotationHypothesis rotation = shown(rig, turned);
    rig.rotate(rotation, before.camera);
    rig.learn(turned, &measured, {}, rotation, false);
    rig.learn(turned, c.next, c.found, {}, false);
    rig.learn(turned, nullptr, disagreeing, {}, false);
    EXPECT_EQ(rig.rotation.isZero(), c.is_taken_back);
    EXPECT_EQ(rig.rotation_covariance.isZero(), c.is_taken_back);
  }
}

TEST(LearntRig, AFewFeaturesShowNoRotation) {
  const LearntRig rig = steady(gridSeenWith(Eigen::Vector3d::Zero()));
  StereoFeatures wrong = synthetic::noFeatures(synthetic::camera());
  EXPECT_EQ(shown(rig, wrong).log_odds, kUnsuspected);
  for (int i = 0; i < 3; ++i) wrong.append({200.f + 100.f * static_cast<float>(i), 150.f, 60.f, 1.4f, 10.f, -1.f, 1.f});
  EXPECT_EQ(shown(rig, wrong).log_odds, kUnsuspected);
}

TEST(LearntRig, ARigWhoseRowsAlwaysChangeIsNotSaidToTurn) {
  LearntRig rig = steady(gridSeenWith(Eigen::Vector3d::Zero()));
  for (int k = 0; k < 100; ++k) {
    const StereoFeatures features = gridSeenWith(Eigen::Vector3d(0.0, 0.0, 3e-3 * std::sin(0.1 * k)));
    EXPECT_LT(shown(rig, features).log_odds, logOdds(0.05)) << "pair " << k;
    learn(rig, features);
  }
  EXPECT_GT(shown(rig, gridSeenWith(Eigen::Vector3d(0.0, 0.0, 60e-3))).log_odds, 0.0);
}

TEST(LearntRig, WhatALateRightImageShowsInATurnIsNoRotation) {
  const LearntRig rig = steady(gridSeenWith(Eigen::Vector3d::Zero()));
  const Eigen::Vector3d turn(0.0, 0.0, 0.2);  // rad in 0.1 s: 3 ms late (calibration/right_delay_sigma) are 6 mrad
  const StereoFeatures turned = gridSeenWith({0.0, 0.0, 6e-3});
  EXPECT_GT(shown(rig, turned).log_odds, 0.0);
  EXPECT_LT(shown(rig, turned, turn).log_odds, logOdds(0.05));
}

TEST(LearntRig, WhereImagesWereRefusedARotationByTheCamerasTurnIsAnotherMoment) {
  const StereoFeatures before = gridSeenWith(Eigen::Vector3d::Zero()), turned = gridSeenWith({0.0, 0.0, 6e-3});
  LearntRig rig = steady(before);
  const Eigen::Vector3d turn(0.0, 0.0, 6e-3), another(0.0, 6e-3, 0.0);
  EXPECT_GT(shown(rig, turned, turn).log_odds, 0.0) << "images without fault";
  StereoFeatures refused = synthetic::noFeatures(before.camera);
  refused.report.refused = true;
  rig.learn(refused, nullptr, {}, {}, false);
  EXPECT_LT(shown(rig, turned, turn).log_odds, 0.0);
  EXPECT_GT(shown(rig, turned, turn).log_odds_of_other_moment, 0.0);
  EXPECT_GT(shown(rig, turned, another).log_odds, 0.0);
  learn(rig, before, 20);
  EXPECT_GT(shown(rig, turned, turn).log_odds, 0.0) << "long ago";
}

}  // namespace sdvo::test_learnt_rig
