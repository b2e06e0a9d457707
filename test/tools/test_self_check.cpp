#include <gtest/gtest.h>

#include "../../src/tools/feature_halves.hpp"
#include "../../src/tools/self_check.hpp"
#include "../said.hpp"
#include "../synthetic_features.hpp"

namespace sdvo::test_self_check {

constexpr std::int64_t kPeriod = 100000000;  // ns
constexpr int kPairs = 40;

Eigen::Isometry3d pose(double x, double y, double z, double turn) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(turn, Eigen::Vector3d(0.2, 0.9, -0.3).normalized());
}

Trajectory truth(int pairs) {
  Trajectory poses;
  for (int k = 0; k < pairs; ++k) poses.push_back(syntheticPose(k));
  return poses;
}

/// A drive through a scene with its halves and its way back.
struct Drive {
  OfflineRun whole{PipelineOptions{}}, first{PipelineOptions{}}, second{PipelineOptions{}}, back{PipelineOptions{}};

  /// `believed_baseline`: what the odometry takes for it, m; 0: the true one. From pair `blind` on nothing is seen.
  explicit Drive(std::uint32_t seed, double believed_baseline = 0.0, int blind = kPairs) {
    SyntheticScene scene(seed, 2500, 120.0);
    FeatureHalves halves;
    std::vector<StereoFeatures> pairs;
    for (int k = 0; k < kPairs; ++k) {
      StereoFeatures pair = scene.view(syntheticPose(k), (k + 1) * kPeriod);
      if (believed_baseline > 0.0) pair.camera.baseline = believed_baseline;
      if (k >= blind) pair = pair.select({});
      whole.processFeatures(pair);
      const auto halved = halves.split(pair, whole.last().flow);
      first.processFeatures(pair.select(halved[0]));
      second.processFeatures(pair.select(halved[1]));
      pairs.push_back(pair);
    }
    for (int k = kPairs - 1; k >= 0; --k) {
      pairs[static_cast<std::size_t>(k)].stamp = (kPairs - k) * kPeriod;
      back.processFeatures(pairs[static_cast<std::size_t>(k)]);
    }
  }

  SubPathErrors errors(double length) const { return subPathErrors(truth(kPairs), whole.poses(), {length}).front(); }
};

TEST(SelfCheck, AShuttleEndsWhereItsTwoWaysLead) {
  const Trajectory out = {pose(5, 1, 2, 0.4), pose(5, 1, 4, 0.9), pose(7, 1, 8, -0.7)};
  Trajectory back(out.rbegin(), out.rend());
  const Eigen::Isometry3d elsewhere = pose(-3, 2, 1, 1.1);
  for (Eigen::Isometry3d& T : back) T = elsewhere * T;
  EXPECT_TRUE(shuttleEnd(out, back).isApprox(Eigen::Isometry3d::Identity(), 1e-12));
  const Eigen::Isometry3d error = pose(0.1, -0.2, 0.3, 0.05);
  back.back() = back.back() * error;
  EXPECT_TRUE(shuttleEnd(out, back).isApprox(error, 1e-12));
}

/// Errors of features that are independent are what the factor of two is derived from.
TEST(SelfCheck, HalvesImplyTheErrorOfIndependentFeatures) {
  double implied_t = 0.0, implied_r = 0.0, true_t = 0.0, true_r = 0.0;
  for (const std::uint32_t seed : {31u, 32u, 33u}) {
    const Drive drive(seed);
    const SelfCheck check = checkHalves(drive.whole, drive.first, drive.second);
    ASSERT_EQ(check.problem, "");
    EXPECT_EQ(check.pairs, kPairs);
    EXPECT_NEAR(check.distance, distancesTravelled(truth(kPairs)).back(), 1.0);
    EXPECT_NEAR(check.difference.length, 0.1 * check.distance, 1e-9);
    const SubPathErrors errors = drive.errors(check.difference.length);
    implied_t += check.errorPercent(), implied_r += check.errorDegPerM();
    true_t += errors.translation_percent, true_r += errors.rotation_deg_per_m;
  }
  EXPECT_GT(implied_t, 0.5 * true_t);
  EXPECT_LT(implied_t, 2.0 * true_t);
  EXPECT_GT(implied_r, 0.5 * true_r);
  EXPECT_LT(implied_r, 2.0 * true_r);
}

TEST(SelfCheck, AShuttleComesBackButNotExactly) {
  const Drive drive(34);
  const SelfCheck check = checkShuttle(drive.whole, drive.back);
  ASSERT_EQ(check.problem, "");
  EXPECT_GT(check.end_m, 1e-6) << "key frames of the way out would bring it back exactly";
  EXPECT_LT(check.end_m, 0.02 * check.distance);
  EXPECT_GT(check.difference.count, kPairs / 2);
  const auto sqrt_half = 0.70710678;
  EXPECT_NEAR(check.errorPercent(), sqrt_half * check.difference.translation_percent, 1e-6);
}

/// What both estimates have in common cancels, here a baseline that is 3 % too long.
TEST(SelfCheck, IsBlindForAWrongScale) {
  const Drive drive(35, 1.03 * 0.54);
  for (const SelfCheck& check :
       {checkHalves(drive.whole, drive.first, drive.second), checkShuttle(drive.whole, drive.back)}) {
    ASSERT_EQ(check.problem, "");
    EXPECT_GT(drive.errors(check.difference.length).translation_percent, 2.0);
    EXPECT_LT(check.errorPercent(), 1.0) << check.name;
  }
}

TEST(SelfCheck, ALostDriveHasNoFigures) {
  const Drive drive(36, 0.0, kPairs / 2);
  ASSERT_GT(drive.whole.pairsWithoutPose(), 0) << "else this tests nothing";
  for (const SelfCheck& check :
       {checkHalves(drive.whole, drive.first, drive.second), checkShuttle(drive.whole, drive.back)}) {
    EXPECT_TRUE(contains(check.problem, "no pose")) << check.problem;
    EXPECT_EQ(check.row().rfind(check.name + ",40,", 0), 0u);
    EXPECT_TRUE(contains(check.row(), ",,,,,,,,")) << check.row();
    EXPECT_TRUE(contains(check.text(), "no figure")) << check.text();
  }
  // A half alone that is lost is no better.
  const Drive good(37);
  const SelfCheck check = checkHalves(good.whole, drive.first, good.second);
  EXPECT_TRUE(contains(check.problem, "the first half")) << check.problem;
}

TEST(SelfCheck, ACameraThatStandsHasNoErrorForEachMetre) {
  SyntheticScene scene(38, 2500, 120.0);
  OfflineRun one{PipelineOptions{}}, other{PipelineOptions{}};
  for (int k = 1; k <= 5; ++k) {
    one.processFeatures(scene.view(syntheticPose(0), k * kPeriod));
    other.processFeatures(scene.view(syntheticPose(0), k * kPeriod));
  }
  const SelfCheck check = checkHalves(one, one, other);
  ASSERT_EQ(check.problem, "");
  EXPECT_EQ(check.difference.count, 0);
  EXPECT_GT(check.end_m, 0.0);
  EXPECT_TRUE(contains(check.text(), "stands")) << check.text();
  const std::string columns = SelfCheck::columns(), row = check.row();
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), std::count(columns.begin(), columns.end(), ','));
}

/// As some drivers publish it of a lens that focuses: the drive goes on, as it does on a robot.
TEST(OfflineRun, ACameraThatChangesALittleIsTheSame) {
  SyntheticScene scene(40, 2500, 120.0);
  OfflineRun run{PipelineOptions{}};
  for (int k = 0; k < 10; ++k) {
    StereoFeatures pair = scene.view(syntheticPose(k), (k + 1) * kPeriod);
    pair.camera.fx *= 1.0 + 1e-4 * (k % 3);
    run.processFeatures(pair);
    EXPECT_EQ(run.last().state, TrackingState::kTracking) << run.last().reason;
  }
  EXPECT_EQ(run.discontinuities(), 0);
}

TEST(SelfCheck, APairAloneHasNoMotion) {
  SyntheticScene scene(39, 2500, 120.0);
  OfflineRun run{PipelineOptions{}};
  run.processFeatures(scene.view(syntheticPose(0), kPeriod));
  EXPECT_TRUE(contains(checkShuttle(run, run).problem, "one pair"));
}

}  // namespace sdvo::test_self_check
