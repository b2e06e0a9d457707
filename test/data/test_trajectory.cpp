#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "../said.hpp"
#include "../temporary_folder.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo::test_trajectory {

namespace fs = std::filesystem;

/// A file that is removed at the end of the test.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text = "") { std::ofstream(path_) << text; }
  const std::string& path() const { return path_; }

 private:
  const TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "trajectory.txt").string();
};

Eigen::Isometry3d pose(double x, double y, double z, double angle = 0.0,
                       const Eigen::Vector3d& axis = Eigen::Vector3d::UnitY()) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(angle, axis.normalized());
}

/// `steps` + 1 poses along z, 0.5 m apart: sums of binary fractions, so that distances are exact.
Trajectory straightLine(int steps, double scale = 1.0) {
  Trajectory poses;
  for (int i = 0; i <= steps; ++i) poses.push_back(pose(0.0, 0.0, 0.5 * i * scale));
  return poses;
}

Trajectory curve(int count) {
  Trajectory poses = {Eigen::Isometry3d::Identity()};
  const Eigen::Isometry3d step = pose(0.02, -0.01, 0.8, 0.05, {0.1, 1.0, -0.2});
  while (static_cast<int>(poses.size()) < count) poses.push_back(poses.back() * step);
  return poses;
}

const char kIdentityLine[] = "1 0 0 0 0 1 0 0 0 0 1 0\n";

TEST(KittiPoses, SurviveWritingAndReading) {
  const TemporaryFile file;
  const Trajectory written = curve(30);
  writeKittiPoses(file.path(), written);
  const Trajectory read = readKittiPoses(file.path());
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_TRUE(read[i].isApprox(written[i], 1e-11)) << i;
}

TEST(KittiPoses, AreRowMajor) {
  // A quarter turn about z: x of the camera points along y of the world.
  const TemporaryFile file("0 -1 0 10  1 0 0 20  0 0 1 30\r\n\n");
  const Trajectory poses = readKittiPoses(file.path());
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_TRUE((poses[0] * Eigen::Vector3d(1.0, 0.0, 0.0)).isApprox(Eigen::Vector3d(10.0, 21.0, 30.0), 1e-12));
}

TEST(KittiPoses, RoundedRotationsBecomeExact) {
  const TemporaryFile file("0.7071 0 0.7071 0 0 1 0 0 -0.7071 0 0.7071 0\n");
  const Eigen::Matrix3d rotation = readKittiPoses(file.path()).front().linear();
  EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(rotation(0, 2), std::sqrt(0.5), 1e-12);
}

TEST(KittiPoses, ErrorsNameFileAndLine) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"1 0 0 0 0 1 0 0 0 0 1\n", "found 11"},
      {"1 0 0 0 0 1 0 0 0 0 1 0 0\n", "found 13"},
      {"1 0 0 nan 0 1 0 0 0 0 1 0\n", "'nan' is not a finite number"},
      {"1 0 0 inf 0 1 0 0 0 0 1 0\n", "'inf' is not a finite number"},
      {"1 0 0 1e999 0 1 0 0 0 0 1 0\n", "'1e999' is not a finite number"},
      {"1 0 0 2,5 0 1 0 0 0 0 1 0\n", "'2,5' is not a finite number"},
      {"2 0 0 0 0 1 0 0 0 0 1 0\n", "not a rotation"},
      {"-1 0 0 0 0 1 0 0 0 0 1 0\n", "not a rotation"},
      {"0 0 0 0 0 0 0 0 0 0 0 0\n", "not a rotation"},
      {std::string("\n") + kIdentityLine, "blank line"},
  };
  for (const auto& [line, what] : cases) {
    const TemporaryFile file(kIdentityLine + line);
    expectError([&] { readKittiPoses(file.path()); }, {file.path() + "', line 2: ", what});
  }
}

TEST(KittiPoses, MissingEmptyAndDirectoryFilesAreNamed) {
  const TemporaryFile empty;
  EXPECT_EQ(errorOf([&] { readKittiPoses(empty.path()); }), "file '" + empty.path() + "' contains no poses");
  expectError([] { readKittiPoses("/nowhere/poses.txt"); }, {"'/nowhere/poses.txt': it does not exist"});
  expectError([] { readKittiPoses(fs::temp_directory_path().string()); }, {"is a directory"});
  EXPECT_EQ(errorOf([] { writeKittiPoses("/nowhere/out.txt", curve(2)); }),
            "'/nowhere/out.txt': cannot be written: No such file or directory");
}

TEST(TumPoses, SurviveWritingAndReadingToTheNanosecond) {
  const TemporaryFile file;
  const StampedTrajectory written{{-1250000000, 0, 1, 1403636584763555584}, curve(4)};
  writeTumPoses(file.path(), written);
  const StampedTrajectory read = readPoses(file.path());
  EXPECT_EQ(read.stamps, written.stamps);
  ASSERT_EQ(read.poses.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(read.poses[i].isApprox(written.poses[i], 1e-11)) << i;
}

TEST(TumPoses, QuaternionIsXyzw) {
  const TemporaryFile file("# a comment\n1.5 1 2 3 0 0 0.7071067811865476 0.7071067811865476\n");
  const StampedTrajectory read = readPoses(file.path());
  EXPECT_EQ(read.stamps, std::vector<std::int64_t>{1500000000});
  EXPECT_TRUE((read.poses[0] * Eigen::Vector3d(1.0, 0.0, 0.0)).isApprox(Eigen::Vector3d(1.0, 3.0, 3.0), 1e-12));
}

TEST(TumPoses, ErrorsNameFileAndLine) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"1 0 0 0 0 0 0 1\n", "not later"},
      {"2 0 0 0 0 0 0 0.5\n", "unit length"},
      {"2 0 0 0 0 0 1\n", "found 7"},
  };
  for (const auto& [line, what] : cases) {
    const TemporaryFile file("1 0 0 0 0 0 0 1\n" + line);
    expectError([&] { readPoses(file.path()); }, {file.path() + "', line 2: ", what});
  }
  EXPECT_THROW(writeTumPoses("/dev/null", {{0}, {}}), std::invalid_argument);
  const TemporaryFile beyond("9999999999999999999 " + std::string(kIdentityLine));  // of 64 bits
  expectError([&] { readPoses(beyond.path()); }, {beyond.path(), "not a stamp"});
  const TemporaryFile larger("1e309 0 0 0 0 0 0 1\n");  // than any double
  expectError([&] { readPoses(larger.path()); }, {larger.path(), "out of range"});
  const TemporaryFile lacking("# stamp tx ty tz qx qy qz qw\n1.5 2 3 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  expectError([&] { readPoses(lacking.path()); }, {lacking.path() + "', line 3: expected 7 numbers, found 8"});
  const TemporaryFile only("1.5.5 0 0 0 0 0 0 1\n");  // no other stamp to compare it with
  expectError([&] { readPoses(only.path()); }, {only.path() + "', line 1: '1.5.5' is not a finite number"});
}

TEST(Poses, AFormatIsKnownByItsFirstLine) {
  const TemporaryFile kitti(kIdentityLine), tum("1.5 1 2 3 0 0 0 1\n"),
      euroc("#timestamp [ns], p_RS_R_x [m], …\n1500000000,1,2,3,1,0,0,0,0.1,0.1\n"), other("1 2 3\n");
  EXPECT_TRUE(readPoses(kitti.path()).stamps.empty());
  for (const TemporaryFile* file : {&tum, &euroc}) {
    const StampedTrajectory read = readPoses(file->path());
    EXPECT_EQ(read.stamps, std::vector<std::int64_t>{1500000000});
    EXPECT_TRUE(read.poses.at(0).isApprox(pose(1.0, 2.0, 3.0)));
  }
  expectError([&] { readPoses(other.path()); }, {"line 1: 3 numbers", "KITTI", "TUM", "EuRoC"});
  expectError([&] { readKittiPoses(tum.path()); }, {"poses in TUM's"});
}

TEST(Poses, OfTartanAirAreThoseOfTheCameraOnANedBody) {
  const TemporaryFile file("0 0 0 0 0 0 1\n2 1 3 0 0 0 1\n");  // ahead, to the right, down
  const StampedTrajectory read = readPoses(file.path());
  EXPECT_TRUE(read.stamps.empty());
  EXPECT_TRUE((read.poses[0].inverse() * read.poses[1]).isApprox(pose(1.0, 3.0, 2.0)));
}

/// Lines are those of the pairs' numbers, also after pairs were left out.
TEST(GroundTruth, WithoutStampsIsThatOfThePairsNumbers) {
  const TemporaryFile file;
  writeKittiPoses(file.path(), straightLine(9));
  const auto truth = readGroundTruth(file.path(), {0, 20, 30}, {0, 2, 3});
  EXPECT_DOUBLE_EQ(truth[1]->translation().z(), 1.0);
  EXPECT_DOUBLE_EQ(truth[2]->translation().z(), 1.5);
  EXPECT_DOUBLE_EQ(readGroundTruth(file.path(), {0, 10}, {0, 1}, 6)[1]->translation().z(), 3.5);
  EXPECT_DOUBLE_EQ(readGroundTruth(file.path(), {0, 10}, {0, 1}, 100)[1]->translation().z(), 0.5);
  expectError([&] { readGroundTruth(file.path(), {0, 20}, {0, 12}); }, {file.path(), "10 poses for 13"});
}

TEST(Errors, AreZeroForTheTrajectoryItselfAnywhereInTheWorld) {
  const Trajectory truth = curve(100);
  Trajectory moved;
  for (const Eigen::Isometry3d& p : truth) moved.push_back(pose(5.0, -3.0, 2.0, 1.0, {1.0, 2.0, 3.0}) * p);
  const TrajectoryErrors errors = evaluateTrajectory(truth, moved, {5.0, 20.0});
  EXPECT_EQ(errors.frames, 100);
  EXPECT_GT(errors.sub_paths.count, 100);
  EXPECT_NEAR(errors.sub_paths.translation_percent, 0.0, 1e-11);
  EXPECT_NEAR(errors.sub_paths.rotation_deg_per_m, 0.0, 1e-11);
  EXPECT_NEAR(errors.rpe_translation_m, 0.0, 1e-12);
  EXPECT_NEAR(errors.rpe_rotation_deg, 0.0, 1e-12);
  EXPECT_NEAR(errors.ate_aligned_m, 0.0, 1e-11);
  EXPECT_NEAR(errors.ate_first_pose_m, 0.0, 1e-11);
  EXPECT_NEAR(errors.final_drift_m, 0.0, 1e-11);
  EXPECT_NEAR(errors.scale, 1.0, 1e-12);
}

TEST(Errors, OfATooLongStraightLine) {
  // 41 poses, 20 m. A sub-path of L m ends exactly L / 0.5 frames later, where the estimate is 2 % ahead.
  const TrajectoryErrors errors = evaluateTrajectory(straightLine(40), straightLine(40, 1.02), {5.0, 10.0});
  EXPECT_DOUBLE_EQ(errors.path_length, 20.0);
  ASSERT_EQ(errors.per_length.size(), 2u);
  EXPECT_EQ(errors.per_length[0].count, 31);
  EXPECT_EQ(errors.per_length[1].count, 21);
  EXPECT_EQ(errors.sub_paths.count, 52);
  for (const SubPathErrors& e : errors.per_length) EXPECT_NEAR(e.translation_percent, 2.0, 1e-12);
  EXPECT_NEAR(errors.sub_paths.translation_percent, 2.0, 1e-12);
  EXPECT_NEAR(errors.sub_paths.rotation_deg_per_m, 0.0, 1e-12);
  EXPECT_NEAR(errors.rpe_translation_m, 0.01, 1e-12);
  EXPECT_NEAR(errors.final_drift_m, 0.4, 1e-12);
  EXPECT_NEAR(errors.final_drift_percent, 2.0, 1e-12);
  EXPECT_NEAR(errors.scale, 1.02, 1e-12);
  // Position errors 0.01 i, i = 0 … 40: mean square 1e-4 * 40 * 81 / 6; centred, their variance 1e-4 * (41² - 1) / 12.
  EXPECT_NEAR(errors.ate_first_pose_m, 0.01 * std::sqrt(40.0 * 81.0 / 6.0), 1e-12);
  EXPECT_NEAR(errors.ate_aligned_m, 0.01 * std::sqrt((41.0 * 41.0 - 1.0) / 12.0), 1e-12);
}

TEST(Errors, OfAConstantTurnRate) {
  // The estimate turns in each frame (0.5 m) and moves along its own z: as much for a metre at any length. The acos of
  // a trace would give 0 for 1e-9 rad.
  for (const double turn : {0.1 * M_PI / 180.0, 1e-9}) {
    Trajectory estimate = {Eigen::Isometry3d::Identity()};
    for (int i = 0; i < 40; ++i) estimate.push_back(estimate.back() * pose(0.0, 0.0, 0.5, turn));
    const TrajectoryErrors errors = evaluateTrajectory(straightLine(40), estimate, {5.0, 10.0});
    const double degrees = turn * 180.0 / M_PI;
    for (const SubPathErrors& e : errors.per_length) EXPECT_NEAR(e.rotation_deg_per_m / degrees, 2.0, 1e-4);
    EXPECT_NEAR(errors.rpe_rotation_deg / degrees, 1.0, 1e-4);
    EXPECT_NEAR(errors.scale, 1.0, 1e-12);
  }
}

TEST(Errors, MeanIsOverSubPathsNotOverLengths) {
  // Only the last step is wrong, by 0.1 m. Length 0.5: 4 sub-paths, one of them wrong (20 %). Length 1: 3, one (10 %).
  Trajectory estimate = straightLine(4);
  estimate.back().translation().z() += 0.1;
  const auto errors = subPathErrors(straightLine(4), estimate, {0.5, 1.0});
  ASSERT_EQ(errors.size(), 3u);
  // As the devkit does by the nominal length: of 0.75 m a sub-path ends after 1 m, 2 cm ahead.
  EXPECT_NEAR(subPathErrors(straightLine(4), straightLine(4, 1.02), {0.75})[0].translation_percent, 100.0 * 0.02 / 0.75,
              1e-12);
  EXPECT_NEAR(errors[0].translation_percent, 20.0 / 4.0, 1e-12);
  EXPECT_NEAR(errors[1].translation_percent, 10.0 / 3.0, 1e-12);
  EXPECT_NEAR(errors[2].translation_percent, 30.0 / 7.0, 1e-12);
}

TEST(Errors, LengthsAreMeasuredAlongThePathNotAsTheCrowFlies) {
  // There and back: after 4 m along the path the position is the start again.
  Trajectory truth;
  for (const double z : {0.0, 1.0, 2.0, 1.0, 0.0}) truth.push_back(pose(0.0, 0.0, z));
  EXPECT_EQ(subPathErrors(truth, truth, {4.0}).front().count, 1);
}

TEST(Errors, AlignmentTurnsButDoesNotScale) {
  const Trajectory truth = curve(50);
  Trajectory twice;
  for (Eigen::Isometry3d p : truth) {
    p.translation() *= 2.0;
    twice.push_back(p);
  }
  // With positions q around their mean, best rotation is none, and the residual of 2q against q is |q|.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : truth) mean += p.translation() / 50.0;
  double spread = 0.0;
  for (const auto& p : truth) spread += (p.translation() - mean).squaredNorm() / 50.0;
  EXPECT_NEAR(evaluateTrajectory(truth, twice, {5.0}).ate_aligned_m, std::sqrt(spread), 1e-9);
}

TEST(Errors, ScaleIgnoresStandstill) {
  Trajectory truth = straightLine(3);
  Trajectory estimate = straightLine(3, 0.9);
  for (int i = 0; i < 10; ++i) {  // the robot stands, the estimate jitters
    truth.push_back(truth.back());
    estimate.push_back(estimate.back() * pose(0.0, 0.0, i % 2 == 0 ? 0.01 : -0.01));
  }
  EXPECT_NEAR(evaluateTrajectory(truth, estimate, {1.0}).scale, 0.9, 1e-12);
}

TEST(Errors, ShorterEstimateIsComparedToTheFirstPoses) {
  const TrajectoryErrors errors = evaluateTrajectory(straightLine(40), straightLine(10), {5.0, 6.0});
  EXPECT_EQ(errors.frames, 11);
  EXPECT_DOUBLE_EQ(errors.path_length, 5.0);
  EXPECT_EQ(errors.per_length[0].count, 1);
  EXPECT_EQ(errors.per_length[1].count, 0);
  EXPECT_TRUE(std::isnan(errors.per_length[1].translation_percent));
  EXPECT_NEAR(errors.sub_paths.translation_percent, 0.0, 1e-12);
}

TEST(Errors, OfTheWorstFrameAndOfTheLast) {
  Trajectory estimate = straightLine(10);
  const double turn = 0.02;  // rad
  estimate[4] = estimate[4] * pose(0.0, 0.3, 0.0, turn);
  estimate[10] = estimate[10] * pose(0.0, 0.1, 0.0, 0.5 * turn);
  const TrajectoryErrors errors = evaluateTrajectory(straightLine(10), estimate, {1.0});
  EXPECT_NEAR(errors.largest_drift_m, 0.3, 1e-12);
  EXPECT_NEAR(errors.final_drift_m, 0.1, 1e-12);
  EXPECT_NEAR(errors.largest_drift_deg, 2.0 * errors.final_drift_deg, 1e-9);
  EXPECT_GT(errors.final_drift_deg, 0.0);
}

TEST(Errors, WithoutMotionAreNaNNotZero) {
  const Trajectory still(3, Eigen::Isometry3d::Identity());
  const TrajectoryErrors errors = evaluateTrajectory(still, still);
  EXPECT_EQ(errors.sub_paths.count, 0);
  EXPECT_TRUE(std::isnan(errors.sub_paths.translation_percent));
  EXPECT_TRUE(std::isnan(errors.final_drift_percent));
  EXPECT_TRUE(std::isnan(errors.scale));
  EXPECT_DOUBLE_EQ(errors.rpe_translation_m, 0.0);
  EXPECT_TRUE(std::isnan(evaluateTrajectory(still, {still[0]}).rpe_translation_m));
}

TEST(Errors, RefuseWhatCannotBeCompared) {
  EXPECT_THROW(evaluateTrajectory(straightLine(3), {}), std::invalid_argument);
  expectError([] { evaluateTrajectory(straightLine(3), straightLine(4)); }, {"5 poses, more than the 4"});
  for (const double length : {0.0, -5.0, std::numeric_limits<double>::infinity(), std::nan("")})
    EXPECT_THROW(evaluateTrajectory(straightLine(3), straightLine(3), {length}), std::invalid_argument) << length;
}

TEST(KittiGroundTruth, HasTheKnownLength) {
  const char* kitti = std::getenv("KITTI_DIR");
  if (kitti == nullptr) GTEST_SKIP() << "KITTI_DIR is not set: the official poses are not read";
  const Trajectory poses = readKittiPoses(std::string(kitti) + "/poses/06.txt");
  ASSERT_EQ(poses.size(), 1101u);
  // 51 frames of 06 cover 59.9 m, the whole sequence 1.23 km (both published figures).
  EXPECT_NEAR(distancesTravelled(poses)[50], 59.9, 0.1);
  EXPECT_NEAR(distancesTravelled(poses).back(), 1232.0, 5.0);
  const TrajectoryErrors errors = evaluateTrajectory(poses, poses);
  EXPECT_NEAR(errors.sub_paths.translation_percent, 0.0, 1e-9);
  EXPECT_NEAR(errors.sub_paths.rotation_deg_per_m, 0.0, 1e-9);
}

}  // namespace sdvo::test_trajectory
