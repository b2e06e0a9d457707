#include <gtest/gtest.h>

#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo {
namespace test_scaled_world {

constexpr int kPairs = 64;
constexpr std::int64_t kPeriod = 100000000;  // ns between pairs

/// Forwards with some sway, and back to where it began.
Eigen::Isometry3d poseOf(int i) {
  const double way = 8.0 * (1.0 - std::cos(0.1 * i));
  Vector6d sway;
  sway << 0.3 * std::sin(0.2 * i), 0.02 * std::sin(0.7 * i), way, 0.004 * std::sin(0.5 * i), 0.05 * std::sin(0.2 * i),
      0.006 * std::sin(0.9 * i);
  return expSE3(sway);
}

/// Everything is sharp, noisy or missing in px, which no scale changes. A part of the view moves by itself later.
StereoFeatures pairOf(int i) {
  static const synthetic::World world = synthetic::randomWorld(1, 1200, {-20.0, -4.0, -2.0}, {20.0, 3.0, 45.0});
  static const synthetic::World mover = synthetic::randomWorld(2, 200, {-2.0, -2.0, 4.0}, {3.0, 2.0, 7.0});
  static const synthetic::World elsewhere = synthetic::randomWorld(3, 300, {-9.0, -4.0, 3.0}, {9.0, 3.0, 25.0});
  synthetic::Sighting sighting;
  sighting.noise = 0.4;
  sighting.flipped = 0.03;
  sighting.strangers = 30;
  sighting.seed = 100 + static_cast<unsigned>(i);
  const StereoCamera rig = synthetic::camera();
  const std::int64_t stamp = 1000000000 + i * kPeriod;
  const bool is_blind = i == 12 || (i >= 20 && i < 23), is_strange = i >= 30 && i < 34;
  if (is_blind) return synthetic::noFeatures(rig, stamp);
  if (is_strange) return synthetic::observe(elsewhere, rig, poseOf(i).inverse(), stamp, sighting);
  StereoFeatures features = synthetic::observe(world, rig, poseOf(i).inverse(), stamp, sighting);
  if (i < 44) return features;
  Eigen::Isometry3d T_camera_mover = Eigen::Isometry3d::Identity();
  T_camera_mover.translation().x() = 0.05 * (i - 44);
  const StereoFeatures moving = synthetic::observe(mover, rig, T_camera_mover, stamp, sighting);
  for (int k = 0; k < moving.count(); ++k)
    synthetic::addFeature(features, moving.u[k], moving.v[k], moving.disparity[k], moving.descriptors.row(k));
  return features;
}

struct Case {
  const char* name;
  double scale;
  bool is_guessed, is_planar;
};

/// The images are those of a world `scale` times as large, seen by a rig that is, too.
std::vector<OdometryResult> follow(const Case& c, double scale) {
  static const std::vector<StereoFeatures> pairs = [] {
    std::vector<StereoFeatures> all;
    for (int i = 0; i < kPairs; ++i) all.push_back(pairOf(i));
    return all;
  }();
  VisualOdometryOptions options;
  options.tracking.doubtful_deviation *= scale;
  options.tracking.max_speed = 35.0 * scale;
  options.tracking.acceleration *= scale;
  options.planar.planar = c.is_planar;
  options.planar.planar_height_sigma *= scale;
  VisualOdometry odometry(options);
  std::vector<OdometryResult> results;
  for (int i = 0; i < kPairs; ++i) {
    StereoFeatures features = pairs[static_cast<std::size_t>(i)];
    features.camera.baseline *= scale;
    MotionGuess guess{poseOf(i - 1).inverse() * poseOf(i)};
    guess.T_previous_current.translation() *= scale * (i == 21 ? 0.0 : 1.02);
    results.push_back(odometry.update(features, c.is_guessed ? std::optional(guess) : std::nullopt));
  }
  return results;
}

/// A scale changes metres and nothing else.
TEST(ScaledWorld, HasScaledPosesCovariancesAndTheSameStates) {
  for (const Case& c : {Case{"an endoscope", 1.0 / 30.0, false, false}, Case{"a ship with guesses", 25.0, true, false},
                        Case{"a small robot on its floor", 1.0 / 30.0, true, true}}) {
    Vector6d unit;
    unit << Eigen::Vector3d::Constant(1.0 / c.scale), Eigen::Vector3d::Ones();
    const auto expectSame = [&](const Matrix6d& scaled, const Matrix6d& covariance) {
      const Matrix6d found = unit.asDiagonal() * scaled * unit.asDiagonal();
      for (int k = 0; k < 6; ++k)
        EXPECT_NEAR(found(k, k), covariance(k, k), 1e-4 * covariance(k, k) + 1e-15) << "direction " << k;
    };
    const auto expectSamePose = [&](Eigen::Isometry3d scaled, const Eigen::Isometry3d& pose) {
      scaled.translation() /= c.scale;
      EXPECT_LT(logSE3(scaled.inverse() * pose).norm(), 1e-5);
    };
    const auto usual = follow(c, 1.0), scaled = follow(c, c.scale);
    const auto isDegraded = [](const OdometryResult& result) { return result.state == TrackingState::kDegraded; };
    EXPECT_GT(std::count_if(usual.begin(), usual.end(), isDegraded), 2) << "nothing goes wrong in " << c.name;
    for (std::size_t i = 0; i < usual.size() && !HasFailure(); ++i) {
      SCOPED_TRACE(c.name + std::string(", pair ") + std::to_string(i) + ": " + usual[i].reason);
      EXPECT_EQ(scaled[i].state, usual[i].state) << scaled[i].reason;
      EXPECT_EQ(scaled[i].inliers, usual[i].inliers);
      EXPECT_EQ(scaled[i].has_pose, usual[i].has_pose);
      EXPECT_EQ(scaled[i].epoch, usual[i].epoch);
      expectSamePose(scaled[i].T_origin_camera, usual[i].T_origin_camera);
      expectSamePose(scaled[i].T_previous_current, usual[i].T_previous_current);
      expectSame(scaled[i].pose_covariance, usual[i].pose_covariance);
      expectSame(scaled[i].motion_covariance, usual[i].motion_covariance);
    }
  }
}

}  // namespace test_scaled_world
}  // namespace sdvo
