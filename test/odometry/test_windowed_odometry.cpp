// What the local map, the window and the self-calibration promise, on features whose truth is known.
#include <gtest/gtest.h>
#include <malloc.h>

#include "../synthetic_features.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_windowed_odometry {

constexpr std::int64_t kPeriod = 100000000;  // ns

OdometryResult drive(SyntheticScene& scene, VisualOdometry& odometry, int pairs) {
  OdometryResult result;
  for (int k = 0; k < pairs; ++k) result = odometry.update(scene.view(syntheticPose(k), (k + 1) * kPeriod));
  return result;
}

/// By an odometry of its own.
OdometryResult drive(SyntheticScene& scene, int pairs, const VisualOdometryOptions& options = {}) {
  VisualOdometry odometry(options);
  return drive(scene, odometry, pairs);
}

/// That learns no misalignment, but knows of an offset of the disparities, px.
VisualOdometryOptions withoutCalibration(double known_offset = 0.0) {
  VisualOdometryOptions options;
  options.calibration.enabled = false;
  options.calibration.prior_offset = known_offset;
  return options;
}

TEST(SelfCalibration, RecoversTheDisparityOffsetAndItsBend) {
  for (const double offset : {-0.3, 0.0, 0.3}) {
    SyntheticScene scene(11, 4000, 120.0);
    scene.disparity_offset = offset;
    const OdometryResult result = drive(scene, 40);
    EXPECT_NEAR(result.disparity_offset, offset, 0.05);
    EXPECT_NEAR(result.disparity_bend, 0.0, 0.15) << offset;
    EXPECT_GT(result.disparity_offset_sigma, 0.0) << offset;
  }
  for (const double bend : {-1.0, 1.0}) {
    SyntheticScene scene(17, 6000, 120.0);
    scene.disparity_bend = bend;
    const OdometryResult result = drive(scene, 60);
    EXPECT_NEAR(result.disparity_bend, bend, 0.35) << "the prior, zero, gives way slowly";
    EXPECT_NEAR(result.disparity_offset, 0.0, 0.08) << bend;
    EXPECT_GT(result.disparity_bend_sigma, 0.0) << bend;
  }
}

TEST(SelfCalibrationScale, CompensatesWhatWouldStretchTheTrajectory) {
  const auto length = [](bool enabled) {
    SyntheticScene scene(12, 4000, 120.0);
    scene.disparity_offset = -0.5;
    const VisualOdometryOptions options = enabled ? VisualOdometryOptions() : withoutCalibration();
    return drive(scene, 40, options).T_origin_camera.translation().norm();
  };
  const double truth = syntheticPose(39).translation().norm();
  EXPECT_GT(std::abs(length(false) - truth), 0.01 * truth) << "the offset must matter, else this tests nothing";
  EXPECT_LT(std::abs(length(true) - truth), 0.006 * truth);
}

TEST(SelfCalibrationPrior, AnErrorThatIsKnownBeforehandIsCompensatedFromTheStart) {
  const auto firstStep = [](double known) {
    SyntheticScene scene(12, 4000, 120.0);
    scene.disparity_offset = -2.0;
    return drive(scene, 2, withoutCalibration(known)).T_origin_camera.translation().norm();
  };
  const double truth = syntheticPose(1).translation().norm();
  EXPECT_GT(std::abs(firstStep(0.0) - truth), 0.03 * truth) << "the offset must matter, else this tests nothing";
  EXPECT_LT(std::abs(firstStep(-2.0) - truth), 0.01 * truth);
}

TEST(SelfCalibrationPrior, MatchesAgreeWithTheMapOnceItIsTakenOut) {
  SyntheticScene scene(12, 4000, 120.0);
  scene.disparity_offset = -1.0;
  const OdometryResult result = drive(scene, 3, withoutCalibration(-1.0));
  EXPECT_GT(result.inliers, 0.9 * result.matches);
  EXPECT_LT(result.rms, 0.6) << "0.3 px in u and v, 0.15 px in the disparity, in both pairs";
}

TEST(SelfCalibrationReport, IsBetterKnownOnceDisparitiesHaveProvedGood) {
  SyntheticScene scene(12, 4000, 120.0);
  scene.position_noise = 0.1;
  scene.disparity_noise = 0.02;
  VisualOdometry odometry{VisualOdometryOptions{}};
  double before = 0.0, after = 0.0;
  for (int k = 0; k < 60; ++k) {
    const double sigma = odometry.update(scene.view(syntheticPose(k), (k + 1) * kPeriod)).disparity_offset_sigma;
    if (k < 15) before = sigma;
    after = sigma;
  }
  EXPECT_LT(after, 0.5 * before);
}

TEST(SelfCalibrationReport, IsNotANumberBeforeThereIsAnEstimate) {
  SyntheticScene scene(13, 2000, 60.0);
  EXPECT_TRUE(std::isnan(drive(scene, 1).disparity_offset));
  EXPECT_TRUE(std::isnan(drive(scene, 5, withoutCalibration()).disparity_offset));
}

/// A pair with the wrong partner is the driver's fault, not the rig's.
TEST(SelfCalibrationReport, ARefusedPairKeepsWhatTheRigTaughtAndTheMap) {
  SyntheticScene scene(13, 4000, 60.0);
  scene.disparity_offset = -1.0;
  VisualOdometry odometry{VisualOdometryOptions{}};
  const OdometryResult before = drive(scene, odometry, 20);
  ASSERT_LT(before.disparity_offset, -0.5);
  for (const int k : {20, 21}) {
    StereoFeatures none = scene.view(syntheticPose(k), (k + 1) * kPeriod, 1.0);
    none.report.refused = true;
    EXPECT_NEAR(odometry.update(none).disparity_offset, before.disparity_offset, 1e-3);
  }
  for (int k = 22; k < 26; ++k) {
    const OdometryResult result = odometry.update(scene.view(syntheticPose(k), (k + 1) * kPeriod));
    EXPECT_EQ(result.epoch, before.epoch);
    EXPECT_NEAR(result.disparity_offset, before.disparity_offset, 0.1);
    if (k > 22) {
      EXPECT_EQ(result.state, TrackingState::kTracking) << k << ": " << result.reason;
      const double step = (syntheticPose(k - 1).inverse() * syntheticPose(k)).translation().norm();
      EXPECT_NEAR(result.T_previous_current.translation().norm(), step, 0.03 * step);
    }
  }
}

TEST(StandingStill, DoesNotDrift) {
  SyntheticScene scene(14, 3000, 60.0);
  VisualOdometry odometry{VisualOdometryOptions{}};
  OdometryResult result;
  double early = 0.0, late = 0.0;  // m
  for (int k = 0; k < 120; ++k) {
    result = odometry.update(scene.view(Eigen::Isometry3d::Identity(), (k + 1) * kPeriod));
    (k < 60 ? early : late) = std::max(k < 60 ? early : late, result.T_origin_camera.translation().norm());
  }
  EXPECT_EQ(result.keyframe_id, 1) << "measured against the first pair all the time";
  EXPECT_LT(late, 0.02);
  EXPECT_LT(late, 2.0 * early) << "a random walk would have grown";
}

// How well it is calibrated, test_rendered_odometry tells; here the noise is smaller than of real corners.
TEST(MotionCovariance, ContainsTheErrorWithoutExaggeration) {
  constexpr double kChiSquare95 = 12.592;  // six degrees of freedom
  int inside = 0, total = 0;
  double sum = 0.0;
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    SyntheticScene scene(100 + seed, 4000, 100.0);
    VisualOdometry odometry{VisualOdometryOptions{}};
    for (int k = 0; k < 30; ++k) {
      const OdometryResult result = odometry.update(scene.view(syntheticPose(k), (k + 1) * kPeriod));
      if (!result.has_motion) continue;
      const Eigen::Isometry3d truth = syntheticPose(k - 1).inverse() * syntheticPose(k);
      const Vector6d error = logSE3(result.T_previous_current.inverse() * truth);
      const double normalised = mahalanobisSquare(error, result.motion_covariance);
      inside += normalised < kChiSquare95;
      sum += normalised;
      ++total;
    }
  }
  EXPECT_GE(static_cast<double>(inside) / total, 0.90);
  EXPECT_GE(sum / total, 0.25 * 6.0) << "standard deviations more than twice too large";
}

TEST(PoseCovariance, ContainsTheLengthThatAnUnknownOffsetOfTheRigCosts) {
  for (const double offset : {-0.1, 0.1, 0.5}) {
    SyntheticScene scene(16, 400, 100.0);
    scene.disparity_offset = offset;
    const OdometryResult result = drive(scene, 12);
    const double error = std::abs(result.T_origin_camera.translation().norm() - syntheticPose(11).translation().norm());
    const double sigma = std::sqrt(result.pose_covariance.topLeftCorner<3, 3>().trace());
    EXPECT_LT(error, 3.0 * sigma) << offset;
    EXPECT_LT(sigma, 0.1 * syntheticPose(11).translation().norm()) << offset;
  }
}

constexpr int kRound = 60;  // pairs

/// Again and again 32 m ahead and back.
Eigen::Isometry3d backAndForth(int i) {
  return Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 16.0 * (1.0 - std::cos(2.0 * M_PI * i / kRound))));
}

/// Three times 32 m ahead and back again, with disparities so noisy that the odometry drifts.
struct ThereAndBack {
  double error = 0.0;               ///< of the last position, m
  double largest_correction = 0.0;  ///< m
  double normalised_square = 0.0;   ///< mean over the motions
  double worst_cover = 0.0;         ///< normalised square of a correction by the pose's covariance
};

ThereAndBack driveThereAndBack(int remembered_keyframes) {
  SyntheticScene scene(8, 2500, 120.0);
  scene.patches = true;
  scene.position_noise = 0.8;
  scene.disparity_noise = 1.2;
  VisualOdometryOptions options;
  options.map.remembered_keyframes = remembered_keyframes;
  options.map.min_shared_points = 50;
  VisualOdometry odometry(options);
  ThereAndBack drive;
  Eigen::Isometry3d last = Eigen::Isometry3d::Identity();
  constexpr int kPairs = 180;
  for (int i = 0; i <= kPairs; ++i) {
    const Eigen::Isometry3d T_origin_camera = backAndForth(i);
    const OdometryResult result = odometry.update(scene.view(T_origin_camera, 1 + 200000000LL * i));
    EXPECT_TRUE(result.has_pose) << i << ": " << result.reason;
    drive.error = (result.T_origin_camera.translation() - T_origin_camera.translation()).norm();
    drive.largest_correction = std::max(drive.largest_correction, result.correction.head<3>().norm());
    drive.worst_cover = std::max(drive.worst_cover, mahalanobisSquare(result.correction, result.pose_covariance));
    if (i > 0) {
      const Vector6d error = logSE3((last.inverse() * T_origin_camera).inverse() * result.T_previous_current);
      drive.normalised_square += mahalanobisSquare(error, result.motion_covariance) / kPairs;
    }
    last = T_origin_camera;
  }
  return drive;
}

TEST(WindowedOdometry, EndsWhereItBeganAfterDrivingBackAndForth) {
  const ThereAndBack forgetful = driveThereAndBack(0), remembering = driveThereAndBack(40);
  EXPECT_GT(forgetful.error, 0.01) << "the drive has to be one that drifts";
  EXPECT_LT(remembering.error, 0.005);
  // Its covariances contain what it takes back at once.
  EXPECT_GT(remembering.largest_correction, 0.01);
  EXPECT_LT(remembering.normalised_square, 12.0) << "six numbers";
  EXPECT_LT(remembering.worst_cover, 12.6) << "chi-square of six, 95 %";
}

/// Bytes that the process has of the heap; none known where a sanitizer has taken its place.
double heapInUse() {
#if __GLIBC_PREREQ(2, 33)
  const auto heap = mallinfo2();
#else
  const auto heap = mallinfo();
#endif
  return static_cast<double>(heap.uordblks) + static_cast<double>(heap.hblkhd);
}

TEST(WindowedOdometry, TakesNoMoreMemoryTheLongerItRuns) {
  if (heapInUse() == 0.0) GTEST_SKIP() << "the heap cannot be asked";
  SyntheticScene scene(8, 2500, 120.0);
  scene.patches = true;
  VisualOdometryOptions options;
  options.map.min_shared_points = 50;
  options.map.remembered_keyframes = 4;  // as many soon
  VisualOdometry odometry(options);
  // Round and round, and once in each round something to be doubted: a stamp that says too little time has passed.
  constexpr int kRounds = 12;
  std::int64_t stamp = 1;
  std::vector<double> largest(kRounds, 0.0);
  int doubted = 0;
  for (int i = 0; i < kRound * kRounds; ++i) {
    stamp += i % kRound == kRound / 4 ? 5000000 : 200000000;
    doubted += odometry.update(scene.view(backAndForth(i), stamp)).state == TrackingState::kDegraded;
    double& most = largest[static_cast<std::size_t>(i / kRound)];
    most = std::max(most, heapInUse());
  }
  EXPECT_GE(doubted, kRounds);
  const double early = *std::max_element(largest.begin() + kRounds / 3, largest.begin() + 2 * kRounds / 3);
  const double late = *std::max_element(largest.begin() + 2 * kRounds / 3, largest.end());
  // How many points live how long is chance.
  EXPECT_LT(late, 1.03 * early);
}

}  // namespace sdvo::test_windowed_odometry
