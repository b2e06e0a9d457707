#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "../../src/common/imu_tracks.hpp"
#include "../said.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_imu_tracks {

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

/// Every 10 ms from `begin` to `end`, ms, a rate about z that grows by 1 rad/s in a second.
void fill(GyroTrack& track, int begin, int end) {
  for (int t = begin; t <= end; t += 10) track.add(t * kMillisecond, t * kMillisecond, {0.0, 0.0, 1e-3 * t});
}

double yaw(const GyroTrack& track, int from, int to) {
  const auto R = track.rotation(from * kMillisecond, to * kMillisecond);
  if (!R) return std::numeric_limits<double>::quiet_NaN();
  EXPECT_LT((*R - expSO3({0.0, 0.0, logSO3(*R).z()})).norm(), 1e-12);
  return logSO3(*R).z();
}

TEST(GyroTrack, IntegratesTheRateBetweenTwoTimes) {
  GyroTrack track;
  fill(track, 1000, 1200);
  EXPECT_NEAR(yaw(track, 1000, 1200), 0.5 * (1.2 * 1.2 - 1.0), 1e-12);
  EXPECT_NEAR(yaw(track, 1053, 1138), 0.5 * (1.138 * 1.138 - 1.053 * 1.053), 1e-12) << "in the midst of two";
  EXPECT_EQ(yaw(track, 1100, 1100), 0.0);
}

TEST(GyroTrack, TurnsAboutItsOwnAxes) {
  GyroTrack track;
  track.add(0, 0, {0.5 * M_PI / 0.05, 0.0, 0.0});
  track.add(50 * kMillisecond, 50 * kMillisecond, {0.5 * M_PI / 0.05, 0.0, 0.0});
  track.add(50 * kMillisecond + 1, 50 * kMillisecond + 1, {0.0, 0.5 * M_PI / 0.05, 0.0});
  track.add(100 * kMillisecond + 1, 100 * kMillisecond + 1, {0.0, 0.5 * M_PI / 0.05, 0.0});
  const auto R = track.rotation(0, 100 * kMillisecond + 1);
  ASSERT_TRUE(R);
  EXPECT_LT((*R - expSO3({0.5 * M_PI, 0.0, 0.0}) * expSO3({0.0, 0.5 * M_PI, 0.0})).norm(), 1e-6);
}

TEST(GyroTrack, SaysNothingOfWhatItDidNotMeasure) {
  GyroTrack track;
  EXPECT_FALSE(track.rotation(0, 0));
  fill(track, 1000, 1100);
  fill(track, 1200, 1300);
  EXPECT_FALSE(track.rotation(999 * kMillisecond, 1050 * kMillisecond));
  EXPECT_FALSE(track.rotation(1250 * kMillisecond, 1301 * kMillisecond));
  EXPECT_FALSE(track.rotation(1050 * kMillisecond, 1250 * kMillisecond)) << "a pause";
  EXPECT_FALSE(track.rotation(1050 * kMillisecond, 1040 * kMillisecond));
  EXPECT_TRUE(track.rotation(1200 * kMillisecond, 1300 * kMillisecond));
  track.add(1305 * kMillisecond, 1305 * kMillisecond, {0.0, std::numeric_limits<double>::quiet_NaN(), 0.0});
  EXPECT_FALSE(track.rotation(1200 * kMillisecond, 1305 * kMillisecond));
}

TEST(GyroTrack, NamesTheCause) {
  GyroTrack track;
  const auto cause = [&](int from, int to) {
    std::string problem;
    EXPECT_FALSE(track.rotation(from * kMillisecond, to * kMillisecond, &problem));
    return problem;
  };
  EXPECT_EQ(cause(0, 0), "no rate has come");
  fill(track, 1000, 1100);
  fill(track, 1200, 1300);
  expectWords(cause(1250, 1800), {"newest", "0.500 s older", "late", "clock"});
  expectWords(cause(700, 1250), {"oldest", "0.300 s newer", "start", "clock"});
  expectWords(cause(1050, 1250), {"pause of 0.100 s"});
}

TEST(GyroTrack, BeginsAnewWhenTheClockJumpsBack) {
  GyroTrack track;
  fill(track, 1000, 1100);
  fill(track, 500, 600);
  EXPECT_FALSE(track.rotation(1000 * kMillisecond, 1100 * kMillisecond));
  EXPECT_NEAR(yaw(track, 500, 600), 0.055, 1e-12);
}

TEST(GyroTrack, WhatIsLateOrWildIsLeftOutAndErasesNothing) {
  GyroTrack track;
  fill(track, 1000, 1100);
  for (const std::int64_t stamp : {1095, 900, 1'000'000, -1'000'000})
    track.add(stamp * kMillisecond, 1101 * kMillisecond, {0.0, 0.0, 50.0});
  fill(track, 1110, 1200);
  EXPECT_NEAR(yaw(track, 1000, 1200), 0.5 * (1.2 * 1.2 - 1.0), 1e-12);
}

TEST(GyroTrack, BeginsAnewWhenItsOwnStampsStayBehind) {
  GyroTrack track;
  fill(track, 5000, 5100);
  for (int t = 0; t <= 100; t += 10) track.add((1000 + t) * kMillisecond, (5110 + t) * kMillisecond, {0.0, 0.0, 1.0});
  EXPECT_FALSE(track.rotation(5000 * kMillisecond, 5100 * kMillisecond));
  EXPECT_NEAR(yaw(track, 1000, 1100), 0.1, 1e-12);
}

TEST(GyroTrack, AMeasurementThatComesTwiceCountsOnce) {
  GyroTrack track;
  fill(track, 1000, 1100);
  track.add(1100 * kMillisecond, 1100 * kMillisecond, {0.0, 0.0, 5.0});
  fill(track, 1110, 1200);
  EXPECT_NEAR(yaw(track, 1000, 1200), 0.5 * (1.2 * 1.2 - 1.0), 1e-12);
}

TEST(GyroTrack, ForgetsWhatIsLongAgo) {
  GyroTrack track;
  fill(track, 0, 10500);
  EXPECT_FALSE(track.rotation(400 * kMillisecond, 600 * kMillisecond));
  EXPECT_TRUE(track.rotation(500 * kMillisecond, 600 * kMillisecond));
}

}  // namespace sdvo::test_imu_tracks
