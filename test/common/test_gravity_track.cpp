#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../../src/common/imu_tracks.hpp"
#include "../said.hpp"

namespace sdvo::test_gravity_track {

constexpr std::int64_t kMillisecond = 1000000;
const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();

/// A second and a bit of 100 Hz, with noise that averages out.
void stand(GravityTrack& track, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& rate = kStill) {
  for (int i = 0; i <= 110; ++i)
    track.add((5000 + 10 * i) * kMillisecond, acceleration + Eigen::Vector3d::Constant(i % 2 ? 0.1 : -0.1), rate);
}

TEST(GravityTrack, WhatIsMeasuredWhileStandingIsUp) {
  GravityTrack track;
  const Eigen::Vector3d tilted = 9.81 * Eigen::Vector3d(0.0, std::sin(0.2), std::cos(0.2));
  stand(track, tilted);
  ASSERT_TRUE(track.up());
  EXPECT_LT((*track.up() - tilted.normalized()).norm(), 1e-3);
}

TEST(GravityTrack, SaysNothingOfLessThanASecond) {
  GravityTrack track;
  EXPECT_FALSE(track.up());
  for (int i = 0; i < 100; ++i) track.add(10 * i * kMillisecond, {0.0, 0.0, 9.81}, kStill);
  EXPECT_FALSE(track.up());
  track.add(1000 * kMillisecond, {0.0, 0.0, 9.81}, kStill);
  EXPECT_TRUE(track.up());
  track.add(0, {0.0, 0.0, 9.81}, kStill);  // begins anew
  EXPECT_FALSE(track.up());
}

TEST(GravityTrack, SaysNothingOfASensorThatMovesAndNamesTheCause) {
  GravityTrack nothing, turns, shakes, in_g, free_of_gravity, accelerates, is_broken;
  stand(accelerates, {4.0, 0.0, 9.81});
  stand(is_broken, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  stand(turns, {0.0, 0.0, 9.81}, {0.0, 0.0, 0.3});
  for (int i = 0; i <= 110; ++i) shakes.add(10 * i * kMillisecond, {i % 2 ? 2.0 : -2.0, 0.0, 9.81}, kStill);
  for (int i = 0; i <= 110; ++i) in_g.add(10 * i * kMillisecond, {0.0, 0.6, 0.8}, kStill);
  stand(free_of_gravity, {0.0, 0.0, 0.0});
  const auto cause = [](const GravityTrack& track) {
    std::string problem;
    EXPECT_FALSE(track.up(&problem));
    return problem;
  };
  EXPECT_EQ(cause(nothing), "no acceleration has come");
  nothing.add(0, {0.0, 0.0, 9.81}, kStill);
  expectWords(cause(nothing), {"less than a second"});
  expectWords(cause(turns), {"turns", "0.3 rad/s", "while it stands"});
  expectWords(cause(shakes), {"shakes", "while it stands"});
  expectWords(cause(in_g), {"in g", "m/s^2"});
  expectWords(cause(free_of_gravity), {"0.0 m/s^2", "gravity"});
  for (const GravityTrack* track : {&accelerates, &is_broken}) EXPECT_NE(cause(*track), "");
}

TEST(GravityTrack, GoesByTheLastSecond) {
  GravityTrack track;
  for (int i = 0; i <= 100; ++i) track.add(10 * i * kMillisecond, {0.0, 0.0, 9.81}, {0.0, 0.0, 1.0});
  EXPECT_FALSE(track.up());
  for (int i = 101; i <= 205; ++i) track.add(10 * i * kMillisecond, {0.0, 0.0, 9.81}, kStill);
  EXPECT_TRUE(track.up());
}

TEST(Levelled, KeepsPositionAndYawAndTurnsUpToTheParentsZ) {
  const Eigen::Isometry3d pose = Eigen::Translation3d(1.0, -2.0, 3.0) *
                                 Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d up = Eigen::Vector3d(0.3, -0.2, 0.9).normalized();
  const Eigen::Isometry3d level = levelled(pose, up);
  EXPECT_EQ(level.translation(), pose.translation());
  EXPECT_LT((level.linear() * up - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(std::atan2(level.linear()(1, 0), level.linear()(0, 0)), 2.5, 1e-12);
}

}  // namespace sdvo::test_gravity_track
