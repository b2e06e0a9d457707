#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "../synthetic_features.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"

namespace sdvo {
namespace {

/// Adds a pair seen from a known pose; points are recognised by their descriptors, which are all different.
void see(LocalMap& map, const StereoFeatures& features, int id, const Eigen::Isometry3d& T_origin_camera) {
  std::vector<LocalMap::Sighting> sightings;
  const Eigen::Isometry3d T_camera_origin = T_origin_camera.inverse();
  if (id > 1) {
    const LocalMap::View view = map.view();
    for (std::size_t i = 0; i < view.point.size(); ++i)
      for (int row = 0; row < features.count(); ++row)
        if (std::memcmp(view.rows.descriptors.ptr(static_cast<int>(i)), features.descriptors.ptr(row),
                        static_cast<std::size_t>(features.descriptors.cols)) == 0)
          sightings.push_back(map.sight(PatchAlignmentOptions(), features, T_camera_origin, view.point[i], row));
  }
  map.insert(features, id, T_camera_origin, sightings, RigCalibration());
}

/// The oldest key frame's id after a drive of `pairs` pairs.
int oldestAfter(const LocalMapOptions& options, int pairs, const std::function<Eigen::Vector3d(int)>& position) {
  SyntheticScene scene(3, 3000, 120.0);
  LocalMap map(options);
  for (int id = 1; id <= pairs; ++id) {
    Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
    T_origin_camera.translation() = position(id - 1);
    see(map, scene.view(T_origin_camera, id), id, T_origin_camera);
  }
  return map.oldestId();
}

Eigen::Vector3d hovering(int pair) {
  return {std::sin(0.5 * pair), 0.0, 0.0};
}

Eigen::Vector3d ahead(int pair) {
  return {0.0, 0.0, 2.0 * pair};
}

TEST(LocalMapKeyframes, StayWhereTheRigStays) {
  EXPECT_EQ(oldestAfter(LocalMapOptions(), 40, hovering), 1);
}

TEST(LocalMapKeyframes, GoByAgeWhenNoneLasts) {
  LocalMapOptions options;
  options.lasting_keyframes = 0;
  EXPECT_GT(oldestAfter(options, 40, hovering), 20);
}

TEST(LocalMapKeyframes, GoWhenWhatTheySawIsLeftBehind) {
  const int oldest = oldestAfter(LocalMapOptions(), 40, ahead);
  EXPECT_GT(oldest, 15);
  EXPECT_LE(oldest, 40 - LocalMapOptions().keyframes);
}

TEST(LocalMapView, LooksForWhatWasSeenTwiceAfterItWasOutOfSight) {
  SyntheticScene scene(3, 3000, 120.0);
  LocalMap map{LocalMapOptions()};
  const auto look = [&](int id, double yaw) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    see(map, scene.view(T, id), id, T);
  };
  look(1, 0.0), look(2, 0.0);
  const std::size_t before = map.view().point.size();
  for (int id = 3; id <= 8; ++id) look(id, 0.6);
  EXPECT_GT(before, 100u);
  look(9, 0.0);
  EXPECT_GT(map.view().point.size(), before) << "the points of the first two pairs and the new ones";
}

/// One point on the optical axis in front of a textured wall, seen from a distance.
class Wall {
 public:
  Wall() {
    camera_.fx = camera_.fy = 500.0, camera_.cx = 320.0, camera_.cy = 240.0, camera_.baseline = 0.2;
    camera_.width = 640, camera_.height = 480;
  }

  /// The detector errs by `error` px: patch and position lie there.
  StereoFeatures view(double distance, const Eigen::Vector2d& error = {0.0, 0.0}) const {
    StereoFeatures features;
    features.camera = camera_, features.descriptor = "freak", features.stamp = ++stamp_;
    features.append({static_cast<float>(camera_.cx + error.x()), static_cast<float>(camera_.cy + error.y()),
                     static_cast<float>(camera_.disparity(distance)), 0.f, 10.f, -1.f, 1.f});
    features.descriptors = cv::Mat::zeros(1, 64, CV_8U);
    features.patch_layout = {13, 1.f, 0.f};
    features.patches.create(1, 169, CV_8U);
    for (int j = 0; j < 13; ++j)
      for (int i = 0; i < 13; ++i) {
        // Position on the wall, in the pixels of a view from 10 m.
        const double x = (i - 6 + error.x()) * distance / 10.0, y = (j - 6 + error.y()) * distance / 10.0;
        const double grey = 120.0 + 50.0 * std::sin(0.8 * x + 0.3) + 50.0 * std::cos(0.7 * y - 0.4 * x);
        features.patches.at<std::uint8_t>(0, 13 * j + i) = static_cast<std::uint8_t>(grey + 0.5);
      }
    return features;
  }

  /// Pose from which the wall, 10 m in front of the origin, is at a distance.
  static Eigen::Isometry3d poseAt(double distance) {
    Eigen::Isometry3d T_camera_origin = Eigen::Isometry3d::Identity();
    T_camera_origin.translation().z() = distance - 10.0;
    return T_camera_origin;
  }

 private:
  StereoCamera camera_;
  mutable std::int64_t stamp_ = 0;
};

TEST(LocalMapSight, TakesOutTheDetectorsErrorAtAnotherDepth) {
  const Wall wall;
  LocalMap map{LocalMapOptions()};
  map.insert(wall.view(10.0), 1, Wall::poseAt(10.0), {}, RigCalibration());
  const StereoFeatures features = wall.view(8.0, {0.6, -0.5});
  const LocalMap::Sighting sighting = map.sight(PatchAlignmentOptions(), features, Wall::poseAt(8.0), 0, 0);
  EXPECT_TRUE(sighting.aligned);
  EXPECT_NEAR(sighting.measurement.x(), 320.0, 0.06);
  EXPECT_NEAR(sighting.measurement.y(), 240.0, 0.06);
  EXPECT_NEAR(sighting.measurement.z(), features.disparity[0], 1e-6);
  EXPECT_NEAR(sighting.scale, 1.25, 1e-6);
  EXPECT_LT(sighting.sigma, 0.1);
}

TEST(LocalMapSight, IsTheCornerWithoutAnAlignment) {
  const Wall wall;
  LocalMap map{LocalMapOptions()};
  map.insert(wall.view(10.0), 1, Wall::poseAt(10.0), {}, RigCalibration());
  const auto expectCorner = [&](const PatchAlignmentOptions& options, const StereoFeatures& features) {
    const LocalMap::Sighting sighting = map.sight(options, features, Wall::poseAt(10.0), 0, 0);
    EXPECT_FALSE(sighting.aligned);
    EXPECT_EQ(sighting.measurement.x(), features.u[0]);
    EXPECT_EQ(sighting.measurement.y(), features.v[0]);
    EXPECT_EQ(sighting.sigma, LocalMapOptions().corner_sigma);
  };
  StereoFeatures features = wall.view(10.0, {0.6, -0.5});
  PatchAlignmentOptions off;
  off.enabled = false;
  expectCorner(off, features);
  StereoFeatures unlike = features;
  cv::RNG(1).fill(unlike.patches, cv::RNG::UNIFORM, 0, 256);
  expectCorner(PatchAlignmentOptions(), unlike);
  features.patch_layout.side = 0;
  features.patches.release();
  expectCorner(PatchAlignmentOptions(), features);
}

TEST(LocalMapSight, RenewsTheReferenceWhenTheScaleHasChangedAndKeepsThePoint) {
  const Wall wall;
  LocalMap map{LocalMapOptions()};
  map.insert(wall.view(10.0), 1, Wall::poseAt(10.0), {}, RigCalibration());
  int id = 1;
  const auto approach = [&](double distance, const Eigen::Vector2d& error) {
    const StereoFeatures features = wall.view(distance, error);
    const Eigen::Isometry3d pose = Wall::poseAt(distance);
    const LocalMap::Sighting sighting = map.sight(PatchAlignmentOptions(), features, pose, 0, 0);
    map.insert(features, ++id, pose, {sighting}, RigCalibration());
    return sighting;
  };
  // A little larger: the first reference serves on. 1.25 times: from then on that view is the reference.
  EXPECT_NEAR(approach(9.0, {0.3, 0.2}).scale, 10.0 / 9.0, 1e-3);
  EXPECT_NEAR(approach(8.0, {-0.2, 0.3}).scale, 1.25, 1e-3);
  const LocalMap::Sighting last = approach(7.5, {0.4, -0.3});
  EXPECT_NEAR(last.scale, 8.0 / 7.5, 1e-3);
  EXPECT_TRUE(last.aligned);
  EXPECT_NEAR(last.measurement.x(), 320.0, 0.1) << "the new reference's own error does not move the point";
  EXPECT_NEAR(last.measurement.y(), 240.0, 0.1);
}

}  // namespace
}  // namespace sdvo
