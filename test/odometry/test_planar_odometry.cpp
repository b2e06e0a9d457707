#include <gtest/gtest.h>

#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_planar_odometry {

constexpr double kStep = 0.8;  // m between pairs
constexpr double kDegree = M_PI / 180.0;

/// Poses of a camera that looks ahead, its way turned by `pitch(i)` (rad, upwards) and `yaw(i)` a pair.
template <class Pitch, class Yaw>
std::vector<Eigen::Isometry3d> drive(int pairs, const Pitch& pitch, const Yaw& yaw) {
  std::vector<Eigen::Isometry3d> poses(1, Eigen::Isometry3d::Identity());
  double heading = 0.0;
  for (int i = 1; i < pairs; ++i) {
    heading += yaw(i);
    poses.push_back(Eigen::Translation3d(poses.back().translation()) *
                    Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitY()) *
                    Eigen::AngleAxisd(pitch(i), Eigen::Vector3d::UnitX()) * Eigen::Translation3d(0.0, 0.0, kStep));
  }
  return poses;
}

/// `pitch`: deg, by which the odometry is told that the camera looks down. From pair `raised_at` on the camera is 10 cm
/// higher on the base.
std::vector<OdometryResult> follow(const std::vector<Eigen::Isometry3d>& poses, bool planar, double pitch = 0.0,
                                   std::size_t raised_at = 1000) {
  static const synthetic::World world = synthetic::randomWorld(3, 25000, {-60.0, -8.0, -10.0}, {60.0, 4.0, 130.0});
  VisualOdometryOptions options;
  options.planar.planar = planar;
  VisualOdometry odometry(options);
  Eigen::Isometry3d T_base_camera = Eigen::Isometry3d::Identity();
  T_base_camera.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  const Eigen::Isometry3d T_base_first = Eigen::Translation3d(0.0, 0.0, 1.0) *
                                         Eigen::AngleAxisd(pitch * kDegree, Eigen::Vector3d::UnitY()) * T_base_camera;
  odometry.mountAt(T_base_first);
  std::vector<OdometryResult> results;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Isometry3d T_first_now(Eigen::Translation3d(0.0, i < raised_at ? 0.0 : -0.1, 0.0));
    odometry.mountAt(T_base_first * T_first_now);
    synthetic::Sighting sighting;
    sighting.noise = 0.8;  // px: lets a free odometry rise by several of the floor's standard deviations
    sighting.strangers = 40;
    sighting.max_depth = 25.0;
    sighting.seed = 100 + static_cast<unsigned>(i);
    results.push_back(
        odometry.update(synthetic::observe(world, synthetic::camera(), (poses[i] * T_first_now).inverse(),
                                           1000000000 + static_cast<std::int64_t>(i) * 100000000, sighting)));
  }
  return results;
}

double largestHeight(const std::vector<OdometryResult>& results) {
  double largest = 0.0;
  for (const OdometryResult& result : results)
    largest = std::max(largest, std::abs(result.T_origin_camera.translation().y()));
  return largest;
}

double errorAtEnd(const std::vector<OdometryResult>& results, const std::vector<Eigen::Isometry3d>& poses) {
  return (results.back().T_origin_camera.translation() - poses.back().translation()).norm();
}

TEST(PlanarOdometry, OnAFlatFloorTheHeightStaysAndTheRestIsNoWorse) {
  const auto poses = drive(
      130, [](int) { return 0.0; }, [](int i) { return 0.01 * std::sin(0.1 * i); });
  const auto planar = follow(poses, true), free = follow(poses, false);
  const PlanarOptions options;
  EXPECT_LT(largestHeight(planar), options.planar_height_sigma) << "m, on 100 m";
  ASSERT_GT(largestHeight(free), 2.0 * options.planar_height_sigma);
  EXPECT_LT(errorAtEnd(planar, poses), errorAtEnd(free, poses) + 0.02);
  for (const OdometryResult& result : planar) EXPECT_EQ(result.state, TrackingState::kTracking) << result.reason;
  // What the constraint gives is in the covariance: y of the camera is down.
  EXPECT_LT(std::sqrt(planar.back().pose_covariance(1, 1)), 1.5 * options.planar_height_sigma)
      << "y is down but for the tilt; the mount is known by this height";
  EXPECT_LT(planar.back().pose_covariance(3, 3), free.back().pose_covariance(3, 3));
  EXPECT_GT(std::sqrt(planar.back().pose_covariance(2, 2)), 1e-3) << "of the way it says nothing";
}

TEST(PlanarOdometry, ARampIsToldOfAndALevelStretchBehindItIsAnotherFloor) {
  const auto onRamp = [](int i) { return i >= 40 && i < 60; };
  const auto poses = drive(
      110, [&](int i) { return onRamp(i) ? 5.0 * kDegree : 0.0; }, [](int) { return 0.0; });
  const auto results = follow(poses, true);
  const double height = poses.back().translation().y();
  ASSERT_LT(height, -1.0) << "upwards";
  EXPECT_LT(errorAtEnd(results, poses), std::sqrt(results.back().pose_covariance.topLeftCorner<3, 3>().trace()))
      << "m: its own standard deviation";
  int floors = 0;
  for (int i = 1; i < 110; ++i) {
    const OdometryResult& result = results[static_cast<std::size_t>(i)];
    ASSERT_TRUE(result.has_pose) << i << ": " << result.reason;
    EXPECT_LT((result.T_origin_camera.translation() - poses[static_cast<std::size_t>(i)].translation()).norm(), 0.15)
        << i;
    if (i > 42 && i < 60) {
      EXPECT_TRUE(contains(result.reason, "off the floor")) << i << ": " << result.reason;
      EXPECT_GT(result.pose_covariance(1, 1), 0.0);
    }
    floors += result.reason.find("this is the floor from now on") != std::string::npos;
  }
  EXPECT_EQ(floors, 1);
  EXPECT_EQ(results.back().reason, "");
}

/// The floor belongs to the base, whose pose does not change.
TEST(PlanarOdometry, AnotherMountIsOnTheSameFloor) {
  const auto poses = drive(
      110, [](int i) { return i >= 40 && i < 60 ? 5.0 * kDegree : 0.0; }, [](int) { return 0.0; });
  const auto results = follow(poses, true, 0.0, 90);
  ASSERT_EQ(results[89].reason, "");
  EXPECT_EQ(results[90].epoch, results[89].epoch + 1);
  EXPECT_FALSE(contains(results[90].reason, "off the floor")) << results[90].reason;
  for (std::size_t i = 91; i < 110; ++i) EXPECT_FALSE(contains(results[i].reason, "off the floor")) << i;
}

TEST(PlanarOdometry, AWrongMountIsInTheCovarianceOfTheHeight) {
  const auto poses = drive(
      60, [](int) { return 0.0; }, [](int i) { return 0.01 * std::sin(0.1 * i); });
  for (const double pitch : {-3.0, 1.0, 3.0}) {
    const Eigen::RowVector3d up(0.0, -std::cos(pitch * kDegree), -std::sin(pitch * kDegree));  // as told
    double height = 0.0, worst = 0.0;
    for (const OdometryResult& result : follow(poses, true, pitch)) {
      const Eigen::RowVector3d in_camera = up * result.T_origin_camera.linear();
      const double variance = in_camera * result.pose_covariance.topLeftCorner<3, 3>() * in_camera.transpose();
      height = up * result.T_origin_camera.translation();
      if (result.distance > 2.0) worst = std::max(worst, std::abs(height) / std::sqrt(variance));
    }
    EXPECT_GT(std::abs(height), 0.3) << "m: a base that climbs by " << pitch << " deg, in truth 0";
    EXPECT_LT(worst, 4.0) << pitch;
  }
}

}  // namespace sdvo::test_planar_odometry
