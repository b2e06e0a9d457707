#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "../../src/data/trajectory_comparison.hpp"
#include "../said.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_trajectory_comparison {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::int64_t kStart = 1700000000000000000, kInterval = 100000000;  // ns

/// A drive with turns and changes of speed.
Trajectory drive(int count = 400) {
  Trajectory poses = {Isometry3d::Identity()};
  for (int i = 1; i < count; ++i)
    poses.push_back(poses.back() *
                    (Eigen::Translation3d(0.0, 0.0, 0.6 + 0.2 * std::sin(0.11 * i)) *
                     AngleAxisd(0.03 * std::sin(0.07 * i) + 0.01 * std::cos(0.23 * i), Vector3d(0.1, 1.0, 0.05).normalized())));
  return poses;
}

/// The same with drift, 0.5 % too long.
Trajectory estimated(const Trajectory& truth) {
  std::mt19937 random(1);
  std::normal_distribution<double> place(0.0, 0.003), turn(0.0, 2e-4);
  Trajectory poses = {Isometry3d::Identity()};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    Isometry3d step = truth[i - 1].inverse() * truth[i];
    step.translation() = 1.005 * step.translation() + Vector3d(place(random), place(random), place(random));
    step.linear() = step.linear() * AngleAxisd(turn(random), Vector3d::UnitY());
    poses.push_back(poses.back() * step);
  }
  return poses;
}

class Comparison : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  /// TUM's lines with stamps as `print` writes them.
  std::string put(const std::string& name, const Trajectory& poses, const std::function<std::string(std::size_t)>& stamp,
                  const std::string& head = "", char separator = ' ') const {
    std::ofstream file(path(name));
    file.precision(12);
    file << head;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Quaterniond q(poses[i].linear());
      file << stamp(i);
      for (const double value : {poses[i].translation().x(), poses[i].translation().y(), poses[i].translation().z(),
                                 q.x(), q.y(), q.z(), q.w()})
        file << separator << value;
      file << "\n";
    }
    return path(name);
  }
  std::string putAt(const std::string& name, const Trajectory& poses, std::int64_t late = 0) const {
    return put(name, poses, [=](std::size_t i) {
      const std::int64_t stamp = kStart + late + kInterval * static_cast<std::int64_t>(i);
      std::string fraction = std::to_string(stamp % 1000000000);
      fraction.insert(0, 9 - fraction.size(), '0');
      return std::to_string(stamp / 1000000000) + "." + fraction;
    });
  }

  static double ate(const TrajectoryComparison& c) { return evaluateTrajectory(c.truth, c.estimate, {5.0}).ate_aligned_m; }
  static double rpe(const TrajectoryComparison& c) { return evaluateTrajectory(c.truth, c.estimate, {5.0}).rpe_translation_m; }
  static std::string all(const TrajectoryComparison& c) {
    std::string text;
    for (const std::string& difference : c.differences) text += difference + "\n";
    return text;
  }

  const TemporaryFolder folder_;
  const Trajectory truth_ = drive(), estimate_ = estimated(truth_);
  const std::string estimate_file_ = putAt("estimate.txt", estimate_);
  const double ate_ = evaluateTrajectory(truth_, estimate_, {5.0}).ate_aligned_m;
};

TEST_F(Comparison, FilesThatDifferByErrorsAloneAreComparedInSilence) {
  const TrajectoryComparison same = compareTrajectories(putAt("truth.txt", truth_), estimate_file_);
  EXPECT_EQ(all(same), "");
  EXPECT_NEAR(ate(same), ate_, 1e-6);
  writeKittiPoses(path("k.txt"), truth_);
  EXPECT_EQ(all(compareTrajectories(path("k.txt"), estimate_file_)), "");
  const Trajectory straight(truth_.begin(), truth_.begin() + 30);
  EXPECT_EQ(all(compareTrajectories(putAt("few.txt", straight), estimate_file_)), "");
}

TEST_F(Comparison, UnitsOfStampsAreRead) {
  for (const auto& [unit, length] : {std::pair("ns", std::int64_t{1}), {"us", std::int64_t{1000}}, {"ms", std::int64_t{1000000}}}) {
    const std::string file = put("units.txt", truth_, [length = length](std::size_t i) {
      return std::to_string((kStart + kInterval * static_cast<std::int64_t>(i)) / length);
    });
    const TrajectoryComparison read = compareTrajectories(file, estimate_file_);
    EXPECT_NEAR(ate(read), ate_, 1e-6) << unit;
    expectWords(all(read), {std::string("are in ") + unit});
  }
}

TEST_F(Comparison, TablesWithAHeadAreReadByTheNamesOfTheirColumns) {
  const auto stamp = [](std::size_t i) { return std::to_string(kStart + kInterval * static_cast<std::int64_t>(i)); };
  for (const char* head : {"timestamp,tx,ty,tz,qx,qy,qz,qw\n", "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z "
                                                               "[m],q_RS_x [],q_RS_y [],q_RS_z [],q_RS_w []\n"})
    EXPECT_NEAR(ate(compareTrajectories(put("head.csv", truth_, stamp, head, ','), estimate_file_)), ate_, 1e-6) << head;
  std::ofstream(path("echo.csv")) << "%time,field.header.seq,field.pose.orientation.w,field.pose.orientation.x,field.pose."
                                     "orientation.y,field.pose.orientation.z,field.pose.position.x,field.pose.position.y,"
                                     "field.pose.position.z\n1700000000000000000,7,1,0,0,0,1,2,3\n";
  const StampedTrajectory read = readPoses(path("echo.csv"));
  EXPECT_EQ(read.stamps, std::vector<std::int64_t>{kStart});
  EXPECT_TRUE(read.poses[0].isApprox(Isometry3d(Eigen::Translation3d(1.0, 2.0, 3.0))));
}

TEST_F(Comparison, LinesWithoutNumbersAreLeftOut) {
  const std::string file = putAt("nan.txt", truth_);
  std::ofstream(file, std::ios::app) << "1700000100.0 nan nan nan nan nan nan nan\n";
  expectWords(all(compareTrajectories(file, estimate_file_)), {"1 lines", "NaN"});
}

TEST_F(Comparison, AShiftInTimeIsFoundSaidAndCorrectedOnRequest) {
  for (const std::int64_t late : {300000000, -70000000, 1200000000}) {
    const std::string file = putAt("late.txt", truth_, late);
    const TrajectoryComparison said = compareTrajectories(file, estimate_file_);
    expectWords(all(said), {"clocks", "--offset auto"});
    ComparisonOptions options;
    options.find_offset = true;
    const TrajectoryComparison found = compareTrajectories(file, estimate_file_, options);
    EXPECT_LT(ate(found), ate_ + 0.02) << late;
    options = {};
    options.offset = 1e-9 * static_cast<double>(late);
    EXPECT_LT(ate(compareTrajectories(file, estimate_file_, options)), ate_ + 0.001);
  }
  const std::string boot = putAt("boot.txt", truth_, 12000000000 - kStart);
  expectError([&] { compareTrajectories(boot, estimate_file_); }, {"no poses belong together", "--offset auto"});
  ComparisonOptions options;
  options.find_offset = true;
  EXPECT_LT(ate(compareTrajectories(boot, estimate_file_, options)), ate_ + 0.05);
}

TEST_F(Comparison, LinesThatAreShiftedAreSaid) {
  writeKittiPoses(path("truth.txt"), truth_);
  writeKittiPoses(path("moved.txt"), Trajectory(estimate_.begin() + 1, estimate_.end()));
  expectWords(all(compareTrajectories(path("truth.txt"), path("moved.txt"))), {"line 2 of the truth", "--offset auto"});
  ComparisonOptions options;
  options.find_offset = true;
  EXPECT_LT(ate(compareTrajectories(path("truth.txt"), path("moved.txt"), options)), ate_ + 0.01);
}

TEST_F(Comparison, AnotherBodyIsFoundSaidAndAlignedOnRequest) {
  const Isometry3d marker = Eigen::Translation3d(0.1, 0.05, -0.2) * AngleAxisd(2.0, Vector3d(1.0, 1.0, 1.0).normalized());
  Trajectory of_marker;
  for (const Isometry3d& pose : truth_) of_marker.push_back(pose * marker);
  const std::string file = putAt("marker.txt", of_marker);
  const TrajectoryComparison said = compareTrajectories(file, estimate_file_);
  expectWords(all(said), {"bodies differ", "114.", "--align"});
  EXPECT_GT(rpe(said), 0.1);
  ComparisonOptions options;
  options.align = true;
  EXPECT_LT(rpe(compareTrajectories(file, estimate_file_, options)), 0.01);
  EXPECT_LT(ate(compareTrajectories(file, estimate_file_, options)), ate_ + 0.02);
}

TEST_F(Comparison, AnotherWorldIsSaidAndCountsForNothing) {
  const Isometry3d world = Eigen::Translation3d(3.0, -8.0, 1.0) * AngleAxisd(1.0, Vector3d::UnitX());
  Trajectory moved;
  for (const Isometry3d& pose : truth_) moved.push_back(world * pose);
  const TrajectoryComparison said = compareTrajectories(putAt("world.txt", moved), estimate_file_);
  expectWords(all(said), {"worlds differ", "57."});
  EXPECT_FALSE(contains(all(said), "bodies"));
  EXPECT_NEAR(ate(said), ate_, 1e-6);
}

TEST_F(Comparison, PosesBelongTogetherByStampsOrElseByLines) {
  const auto write = [this](const std::string& name, const std::string& text) {
    std::ofstream(path(name)) << text;
    return path(name);
  };
  const std::string truth = write("t", "1 0 0 0 0 0 0 1\n1.2 0 0 2 0 0 0 1\n1.4 0 0 4 0 0 0 1\n"),
                    estimate = write("e", "0.5 0 0 9 0 0 0 1\n1.1 0 0 1 0 0 0 1\n1.4 0 0 4 0 0 0 1\n"),
                    fewer = write("f", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  const auto [at_stamps, estimated, differences] = compareTrajectories(truth, estimate);
  ASSERT_EQ(estimated.size(), 2u);  // the truth begins later
  for (const std::size_t i : {0u, 1u}) EXPECT_TRUE(at_stamps[i].isApprox(estimated[i], 1e-12)) << i;
  writeKittiPoses(path("k"), Trajectory(truth_.begin(), truth_.begin() + 3));
  EXPECT_EQ(compareTrajectories(truth, path("k")).estimate.size(), 3u);
  EXPECT_EQ(compareTrajectories(path("k"), fewer).estimate.size(), 1u);
  expectError([&] { compareTrajectories(truth, fewer); }, {"--format"});
}

}  // namespace sdvo::test_trajectory_comparison
