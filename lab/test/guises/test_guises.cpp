#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <tuple>
#include <vector>

#include "../../../test/temporary_folder.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/data/trajectory.hpp"

namespace sdvo::test_guises {

namespace fs = std::filesystem;

/// What the odometry says of a drive, pair by pair.
struct Account {
  Trajectory poses;
  std::vector<std::string> states, reasons;
  std::vector<int> features;
  /// Largest variances of the pose in any direction and about any axis, m² and rad².
  std::vector<double> translation, rotation;
};

std::vector<std::vector<std::string>> readCsv(const fs::path& path, std::size_t columns) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);  // the header
  while (std::getline(file, line)) {
    std::vector<std::string> row;
    std::istringstream stream(line);
    for (std::string field; row.size() + 1 < columns && std::getline(stream, field, ',');) row.push_back(field);
    std::string rest;
    std::getline(stream, rest);
    row.push_back(rest);
    rows.push_back(row);
  }
  return rows;
}

double largestVariance(const std::vector<std::string>& row, int block) {
  constexpr int kPoseCovariance = 42;  // column of its first element
  Eigen::Matrix3d covariance;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      covariance(i, j) = std::stod(row[static_cast<std::size_t>(kPoseCovariance + 6 * (block + i) + block + j)]);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff();
}

void call(const std::string& command) {
  ASSERT_EQ(std::system((command + " > /dev/null").c_str()), 0) << command;
}

Account runOdometry(const fs::path& drive, const fs::path& work) {
  const fs::path poses = work / "poses.txt", states = work / "states.csv", timing = work / "timing.csv";
  call(std::string(SDVO_TOOL_DIR) + "/run_sequence " + drive.string() + " --poses " + poses.string() + " --states " +
       states.string() + " --timing " + timing.string() + " 2> /dev/null");
  Account run;
  run.poses = readKittiPoses(poses.string());
  for (const std::vector<std::string>& row : readCsv(states, 79)) {
    run.states.push_back(row[2]);
    run.reasons.push_back(row[78]);
    run.translation.push_back(largestVariance(row, 0));
    run.rotation.push_back(largestVariance(row, 3));
  }
  for (const std::vector<std::string>& row : readCsv(timing, 15)) run.features.push_back(std::stoi(row[8]));
  return run;
}

void writeGuise(const fs::path& drive, const std::string& guise, const fs::path& output, const std::string& more = "") {
  call(std::string(SDVO_LAB_RUN) + " guises " + drive.string() + " " + guise + " " + output.string() + more);
}

/// A real drive's excerpt, run as it was recorded.
struct Excerpt {
  TemporaryFolder folder;
  fs::path drive = folder.path() / "as_recorded", estimate = folder.path() / "poses.txt";
  Account run;
};

/// A part of a data set. Excerpts have near views, repetitive wood and fast turns (MH_01_half), or houses and a parked
/// car.
struct Source {
  const char *name, *variable, *folder;
  int first, frames;
};

const std::map<std::string, Source>& sources() {
  static const std::map<std::string, Source> all = {
      {"MH_01_half", {"MH_01_half", "EUROC_DIR", "MH_01_half", 105, 45}},
      {"KITTI_06", {"KITTI_06", "KITTI_DIR", "sequences/06", 0, 18}},
  };
  return all;
}

const Excerpt& excerptOf(const Source& source) {
  static std::map<std::string, std::unique_ptr<Excerpt>> kept;
  std::unique_ptr<Excerpt>& excerpt = kept[source.name];
  if (!excerpt) {
    excerpt = std::make_unique<Excerpt>();
    writeGuise(fs::path(std::getenv(source.variable)) / source.folder, "as_recorded", excerpt->drive,
               " --first " + std::to_string(source.first) + " --frames " + std::to_string(source.frames));
    excerpt->run = runOdometry(excerpt->drive, excerpt->folder.path());
  }
  return *excerpt;
}

/// Number of the recorded pair that pair `i` of a guise shows.
int recordedPair(const std::string& guise, int i, int pairs) {
  if (guise == "backwards") return pairs - 1 - i;
  if (guise == "every_2nd") return 2 * i;
  if (guise == "every_3rd") return 3 * i;
  return i;
}

class Guises : public testing::TestWithParam<std::tuple<std::string, std::string>> {};

TEST_P(Guises, LoseNothingAndMoveAlike) {
  const std::string &name = std::get<0>(GetParam()), &guise = std::get<1>(GetParam());
  const Source& source = sources().at(name);
  if (!std::getenv(source.variable))
    GTEST_SKIP() << source.variable << " is not set: guises of a real drive are not run";
  const Excerpt& recorded = excerptOf(source);
  ASSERT_FALSE(recorded.run.poses.empty());
  const TemporaryFolder folder;
  // The motion as recorded, in the frame of the guise's left camera: what the guise's own estimate should be.
  writeGuise(recorded.drive, guise, folder.path() / "guise", " --poses " + recorded.estimate.string());
  const Trajectory expected = readKittiPoses((folder.path() / "guise" / "poses.txt").string());
  const Account run = runOdometry(folder.path() / "guise", folder.path());
  ASSERT_EQ(run.poses.size(), expected.size());
  ASSERT_EQ(run.states.size(), expected.size());

  const auto pairs = static_cast<int>(recorded.run.poses.size());
  const auto recordedAt = [&](std::size_t i) {
    return static_cast<std::size_t>(recordedPair(guise, static_cast<int>(i), pairs));
  };
  double way = 0.0, bound = 0.0;
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    SCOPED_TRACE("pair " + std::to_string(i) + " of " + name + ", " + guise + ": " + run.states[i] + " " +
                 run.reasons[i]);
    ASSERT_NE(run.states[i], "LOST");
    ASSERT_GT(run.features[i], 0) << "refused";
    if (i == 0) continue;
    way += (expected[i].translation() - expected[i - 1].translation()).norm();
    // Both estimates may err by their own covariances; a turn of the first pose moves the last one by its distance.
    const Eigen::Isometry3d moved = run.poses[0].inverse() * run.poses[i], should = expected[0].inverse() * expected[i];
    const Vector6d error = logSE3(moved.inverse() * should);
    const double turns = recorded.run.rotation[recordedAt(0)] + recorded.run.rotation[recordedAt(i)];
    const double shifts = recorded.run.translation[recordedAt(0)] + recorded.run.translation[recordedAt(i)];
    const double distance = should.translation().norm();
    constexpr double kSigmas = 5.0;  // no error may exceed it (lab/docs/faults.md)
    bound = kSigmas * std::sqrt(run.translation[i] + shifts + distance * distance * turns);
    EXPECT_LT(error.head<3>().norm(), bound) << "m, after " << way << " m";
    EXPECT_LT(error.tail<3>().norm(), kSigmas * std::sqrt(run.rotation[i] + turns)) << "rad";
  }
  // Covariances so wide that they allow anything would hide an error.
  EXPECT_LT(bound, 0.2 * way) << "m, after " << way << " m";
}

INSTANTIATE_TEST_SUITE_P(
    RealDrives, Guises,
    testing::Combine(testing::Values("MH_01_half", "KITTI_06"),
                     testing::Values("as_recorded", "every_2nd", "every_3rd", "backwards", "mirrored", "upside_down",
                                     "half", "middle_70", "dark_noise", "saturated")),
    [](const auto& tested) { return std::get<0>(tested.param) + "_" + std::get<1>(tested.param); });

}  // namespace sdvo::test_guises
