#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "../../src/common/imu_tracks.hpp"
#include "../said.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_gyro_track {

constexpr std::int64_t kMillisecond = 1000000;

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

}  // namespace sdvo::test_gyro_track
