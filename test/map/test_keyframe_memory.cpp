#include <gtest/gtest.h>

#include "../../src/map/keyframe_memory.hpp"

namespace sdvo::test_keyframe_memory {

StereoCamera rig() {
  return {400.0, 400.0, 320.0, 240.0, 0.5, 640, 480};
}

/// 100 points on a wall across the view, `distance` m ahead of a camera at `z` m along the optical axis.
OldKeyframe facingAWall(int id, double z, double distance) {
  OldKeyframe keyframe{id, Eigen::Isometry3d::Identity(), {}, {}};
  keyframe.T_camera_origin.translation().z() = -z;
  keyframe.points.resize(100);
  for (int i = 0; i < 100; ++i)
    keyframe.described.positions.emplace_back(0.05 * distance * (i % 10 - 4.5), 0.05 * distance * (i / 10 - 4.5),
                                              distance);
  return keyframe;
}

Eigen::Isometry3d cameraAt(double x, double z) {
  Eigen::Isometry3d T_camera_origin = Eigen::Isometry3d::Identity();
  T_camera_origin.translation() = -Eigen::Vector3d(x, 0.0, z);
  return T_camera_origin;
}

TEST(OldKeyframe, SharesWhatIsInViewAndAboutAsFarAway) {
  const OldKeyframe keyframe = facingAWall(1, 0.0, 10.0);
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(0.0, 0.0)), 100);
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(0.0, 0.8)), 100);
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(0.0, 1.2)), 0) << "points appear larger by more than a tenth";
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(0.0, -1.2)), 0) << "… smaller";
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(8.0, 0.0)), 50)
      << "columns from -2.25 to 2.25 m, the view ends at 8 - 8 m";
  EXPECT_EQ(keyframe.sharedWith(rig(), cameraAt(0.0, 20.0)), 0) << "behind";
}

TEST(KeyframeMemory, FindsTheKeyframeOfAPlace) {
  KeyframeMemory memory(10);
  for (int i = 0; i < 5; ++i) memory.remember(rig(), facingAWall(i, 2.0 * i, 10.0));
  ASSERT_EQ(memory.count(), 5);
  for (int i = 0; i < 5; ++i) {
    const OldKeyframe* found = memory.nearest(rig(), cameraAt(0.0, 2.0 * i + 0.3), 50);
    ASSERT_NE(found, nullptr) << i;
    EXPECT_EQ(found->id, i);
  }
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 30.0), 50), nullptr);
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.0), 101), nullptr) << "more than it has points";
}

TEST(KeyframeMemory, RatherTheNearestThanTheOneThatSharesMost) {
  KeyframeMemory memory(10);
  OldKeyframe nearer = facingAWall(2, 1.2, 10.0);
  nearer.described.positions.resize(80);
  nearer.points.resize(80);
  memory.remember(rig(), facingAWall(1, 0.0, 10.0));
  memory.remember(rig(), nearer);
  ASSERT_EQ(memory.count(), 2);
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.8), 50)->id, 2) << "0.4 m away instead of 0.8 m";
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.8), 90)->id, 1) << "the nearer one shares 80 points";
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.3), 50)->id, 1);
}

TEST(KeyframeMemory, NeedsMostOfAKeyframesPoints) {
  KeyframeMemory memory(10);
  StereoCamera wide = rig();
  wide.baseline = 3.0;
  memory.remember(wide, facingAWall(1, 0.0, 10.0));
  EXPECT_EQ(memory.nearest(wide, cameraAt(8.0, 0.0), 10), nullptr) << "half of them";
  EXPECT_NE(memory.nearest(wide, cameraAt(7.0, 0.0), 10), nullptr) << "seven tenths";
}

TEST(KeyframeMemory, LooksNoFartherThanThreeBaselines) {
  KeyframeMemory memory(10);
  memory.remember(rig(), facingAWall(1, 0.0, 10.0));
  EXPECT_NE(memory.nearest(rig(), cameraAt(1.4, 0.0), 10), nullptr);
  EXPECT_EQ(memory.nearest(rig(), cameraAt(1.6, 0.0), 10), nullptr);
}

TEST(KeyframeMemory, KeepsTheOlderOneOfTwoThatSeeTheSame) {
  KeyframeMemory memory(10);
  memory.remember(rig(), facingAWall(1, 0.0, 10.0));
  memory.remember(rig(), facingAWall(2, 0.1, 9.9));
  EXPECT_EQ(memory.count(), 1);
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.1), 50)->id, 1);
}

TEST(KeyframeMemory, ForgetsTheFarthestOne) {
  KeyframeMemory memory(3);
  for (const int i : {2, 0, 1, 3}) memory.remember(rig(), facingAWall(i, 2.0 * i, 10.0));
  EXPECT_EQ(memory.count(), 3);
  EXPECT_EQ(memory.nearest(rig(), cameraAt(0.0, 0.0), 50), nullptr) << "6 m from the newest";
  EXPECT_NE(memory.nearest(rig(), cameraAt(0.0, 2.0), 50), nullptr);
}

TEST(KeyframeMemory, OfNoCapacityRemembersNothing) {
  KeyframeMemory memory(0);
  memory.remember(rig(), facingAWall(1, 0.0, 10.0));
  EXPECT_EQ(memory.count(), 0);
}

}  // namespace sdvo::test_keyframe_memory
