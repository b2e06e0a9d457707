#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cstring>

#include "../../src/belief/pose_covariance.hpp"
#include "../../src/map/local_map.hpp"
#include "../../src/rig/calibration_filter.hpp"
#include "../synthetic_features.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_local_map {

const Eigen::Isometry3d kOrigin = Eigen::Isometry3d::Identity();

/// Adds a pair seen from a known pose; points, `most` of them, are recognised by their descriptors, which are all
/// different.
void see(LocalMap& map, const StereoFeatures& features, int id, const Eigen::Isometry3d& T_origin_camera,
         std::size_t most = 10000) {
  std::vector<LocalMap::Sighting> sightings;
  const Eigen::Isometry3d T_camera_origin = T_origin_camera.inverse();
  if (id > 1) {
    const LocalMap::View view = map.view();
    for (std::size_t i = 0; i < view.ids.size(); ++i)
      for (int row = 0; row < features.count(); ++row)
        if (std::memcmp(view.points.descriptors.ptr(static_cast<int>(i)), features.descriptors.ptr(row),
                        static_cast<std::size_t>(features.descriptors.cols)) == 0)
          sightings.push_back(map.sight(features, T_camera_origin, view.ids[i], row));
  }
  sightings.resize(std::min(sightings.size(), most));
  map.insert(features, id, T_camera_origin, sightings, RigCalibration());
}

TEST(LocalMap, APairThatSharesHardlyAnythingWithTheOthersIsNotAdjusted) {
  SyntheticScene scene(3, 3000, 120.0);
  LocalMap map{LocalMapOptions()};
  WindowOptimizer optimizer{WindowOptimizerOptions()};
  const CalibrationBelief prior =
      CalibrationFilter(CalibrationOptions()).prior(RigEstimate::CalibrationByRig::Identity());
  const auto isAdjusted = [&](int id, std::size_t recognised) {
    RigCalibration calibration;
    see(map, scene.view(kOrigin, id), id, kOrigin, recognised);
    return map.adjust(optimizer, prior, calibration).success;
  };
  EXPECT_FALSE(isAdjusted(1, 10000)) << "there are no others";
  isAdjusted(2, 10000);
  EXPECT_TRUE(isAdjusted(3, 10000));
  EXPECT_FALSE(isAdjusted(4, 0)) << "nothing holds its pose";
  EXPECT_FALSE(isAdjusted(5, 2)) << "it may turn about two points";
}

/// Even once the pair that began its points has left the map.
TEST(LocalMap, DoubtfulPairsConfirmNoPoint) {
  SyntheticScene scene(3, 3000, 120.0);
  const auto confirmed = [&](bool doubtful) {
    LocalMap map{LocalMapOptions()};
    for (int id = 1; id <= 6; ++id) {
      see(map, scene.view(kOrigin, id), id, kOrigin);
      if (doubtful && id > 1) map.discountNewest();
    }
    return map.points(2).count();
  };
  EXPECT_GT(confirmed(false), 100);
  EXPECT_EQ(confirmed(true), 0);
}

TEST(LocalMapView, LooksForWhatWasSeenTwiceAfterItWasOutOfSight) {
  SyntheticScene scene(3, 3000, 120.0);
  LocalMap map{LocalMapOptions()};
  const auto look = [&](int id, double yaw) {
    const Eigen::Isometry3d T(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
    see(map, scene.view(T, id), id, T);
  };
  look(1, 0.0), look(2, 0.0);
  const std::size_t before = map.view().ids.size();
  for (int id = 3; id <= 8; ++id) look(id, 0.6);
  EXPECT_GT(before, 100u);
  look(9, 0.0);
  EXPECT_GT(map.view().ids.size(), before) << "the points of the first two pairs and the new ones";
}

/// One point on the optical axis in front of a textured wall, seen from a distance.
class Wall {
 public:
  Wall() {
    camera_.fx = camera_.fy = 500.0, camera_.cx = 320.0, camera_.cy = 240.0, camera_.baseline = 0.2;
    camera_.width = 640, camera_.height = 480;
  }

  /// At a place on the wall, in the pixels of a view from 10 m.
  static std::uint8_t grey(double x, double y) {
    return static_cast<std::uint8_t>(120.5 + 50.0 * std::sin(0.8 * x + 0.3) + 50.0 * std::cos(0.7 * y - 0.4 * x));
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
      for (int i = 0; i < 13; ++i)
        features.patches.at<std::uint8_t>(0, 13 * j + i) =
            grey((i - 6 + error.x()) * distance / 10.0, (j - 6 + error.y()) * distance / 10.0);
    return features;
  }

  /// Pose from which the wall, 10 m in front of the origin, is at a distance.
  static Eigen::Isometry3d poseAt(double distance) {
    return Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, distance - 10.0));
  }

  /// A map of the wall as seen from 10 m.
  LocalMap mapped(const LocalMapOptions& options = {}) const {
    LocalMap map(options);
    map.insert(view(10.0), 1, poseAt(10.0), {}, RigCalibration());
    return map;
  }

 private:
  StereoCamera camera_;
  mutable std::int64_t stamp_ = 0;
};

TEST(LocalMapSight, TakesOutTheDetectorsErrorAtAnotherDepth) {
  const Wall wall;
  LocalMap map = wall.mapped();
  const StereoFeatures features = wall.view(8.0, {0.6, -0.5});
  const LocalMap::Sighting sighting = map.sight(features, Wall::poseAt(8.0), 0, 0);
  EXPECT_TRUE(sighting.aligned);
  EXPECT_NEAR(sighting.measurement.x(), 320.0, 0.06);
  EXPECT_NEAR(sighting.measurement.y(), 240.0, 0.06);
  EXPECT_NEAR(sighting.measurement.z(), features.disparity[0], 1e-6);
  EXPECT_NEAR(sighting.scale, 1.25, 1e-6);
  EXPECT_LT(sighting.sigma, 0.1);
}

TEST(LocalMapSight, KnowsWhatATurnedCameraMakesOfAPatch) {
  // The wall again, seen from one place: straight on, then turned away until the point is half a radian off the axis,
  // where a pixel covers less of the wall.
  const Wall wall;
  StereoFeatures features = wall.view(10.0);
  const StereoCamera& camera = features.camera;
  const Eigen::Matrix3d R = expSO3({0.0, -0.5, 0.0});  // camera from wall
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.linear() = R;
  const Eigen::Vector3d pixel = camera.project(R * Eigen::Vector3d(0.0, 0.0, 10.0));
  ASSERT_GT(std::abs(pixel.x() - camera.cx), 200.0);
  const Eigen::Vector2d error(0.6, -0.5);
  features.u[0] = static_cast<float>(pixel.x() + error.x());
  features.v[0] = static_cast<float>(pixel.y() + error.y());
  for (int j = 0; j < 13; ++j)
    for (int i = 0; i < 13; ++i) {
      const Eigen::Vector3d ray((pixel.x() + i - 6 + error.x() - camera.cx) / camera.fx,
                                (pixel.y() + j - 6 + error.y() - camera.cy) / camera.fy, 1.0);
      const Eigen::Vector3d on_wall = R.transpose() * ray;
      features.patches.at<std::uint8_t>(0, 13 * j + i) =
          Wall::grey(camera.fx * on_wall.x() / on_wall.z(), camera.fy * on_wall.y() / on_wall.z());
    }
  LocalMap map = wall.mapped();
  const LocalMap::Sighting sighting = map.sight(features, turned, 0, 0);
  ASSERT_TRUE(sighting.aligned);
  EXPECT_NEAR(sighting.measurement.x(), pixel.x(), 0.06);
  EXPECT_NEAR(sighting.measurement.y(), pixel.y(), 0.06);
  EXPECT_LT(sighting.sigma, 0.05) << "the warped patches hardly differ";
}

TEST(LocalMapSight, IsTheCornerWithoutAnAlignment) {
  const Wall wall;
  LocalMapOptions map_options;
  map_options.noise.corner = 0.7;
  LocalMap map = wall.mapped(map_options);
  const auto expectCorner = [&](const StereoFeatures& features, double sigma) {
    const LocalMap::Sighting sighting = map.sight(features, Wall::poseAt(10.0), 0, 0);
    EXPECT_FALSE(sighting.aligned);
    EXPECT_EQ(sighting.measurement, Eigen::Vector3d(features.u[0], features.v[0], features.disparity[0]));
    EXPECT_EQ(sighting.sigma, sigma);
  };
  StereoFeatures features = wall.view(10.0, {0.6, -0.5});
  StereoFeatures small = features;
  small.patch_layout.side = 9;
  small.patches = features.patches.colRange(0, 81).clone();
  expectCorner(small, 0.7);
  StereoFeatures unlike = features;
  cv::RNG(1).fill(unlike.patches, cv::RNG::UNIFORM, 0, 256);
  expectCorner(unlike, map_options.noise.unconfirmedCorner());
  features.patch_layout.side = 0;
  features.patches.release();
  expectCorner(features, 0.7);
}

TEST(LocalMapSight, RenewsTheReferenceWhenTheScaleHasChangedAndKeepsThePoint) {
  const Wall wall;
  LocalMap map = wall.mapped();
  int id = 1;
  const auto approach = [&](double distance, const Eigen::Vector2d& error) {
    const StereoFeatures features = wall.view(distance, error);
    const Eigen::Isometry3d pose = Wall::poseAt(distance);
    const LocalMap::Sighting sighting = map.sight(features, pose, 0, 0);
    map.insert(features, ++id, pose, {sighting}, RigCalibration());
    map.renewAppearance(features, {sighting});
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

using Sightings = std::vector<LocalMap::Sighting>;

/// `count` points that every pose of these tests sees, none of them nearer than 6 m.
synthetic::World someWorld(int count, unsigned seed = 1) {
  return synthetic::randomWorld(seed, count, {-2.0, -1.5, 6.0}, {2.0, 1.5, 14.0});
}

Eigen::Isometry3d translated(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

/// The points `from` … `to` - 1 of a world, one row each, in that order.
StereoFeatures see(const synthetic::World& world, int from, int to, const Eigen::Isometry3d& T_camera_origin,
                   double noise = 0.0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise);
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  for (int i = from; i < to; ++i) {
    Eigen::Vector3d pixel = features.camera.project(T_camera_origin * world.points[static_cast<std::size_t>(i)]);
    for (int k = 0; noise > 0.0 && k < 3; ++k) pixel[k] += normal(random);
    synthetic::addFeature(features, pixel.x(), pixel.y(), pixel.x() - pixel.z(),
                          world.rows[static_cast<std::size_t>(i)]);
  }
  return features;
}

/// Row `row` of the view's map point as a sighting by row `row_of_pair` of a pair, corners as they are.
LocalMap::Sighting sighting(const LocalMap& map, const LocalMap::View& view, int row, const StereoFeatures& features,
                            int row_of_pair) {
  return map.sight(features, map.newestPose(), view.ids[static_cast<std::size_t>(row)], row_of_pair);
}

/// The pair's rows `from` … recognise the view's rows from 0 on, `count` of them.
Sightings recognised(const LocalMap& map, const StereoFeatures& features, int count, int from = 0) {
  const LocalMap::View view = map.view();
  Sightings sightings;
  for (int k = 0; k < count; ++k) sightings.push_back(sighting(map, view, k, features, from + k));
  return sightings;
}

/// What an odometry does with a pair, without the adjustment.
void add(LocalMap& map, const StereoFeatures& features, int id, const Eigen::Isometry3d& T_camera_origin,
         const Sightings& sightings, const RigCalibration& calibration = {}) {
  map.insert(features, id, T_camera_origin, sightings, calibration);
  map.renewAppearance(features, sightings);
}

LocalMapOptions everyPairAKeyframe() {
  LocalMapOptions options;
  options.keyframe_parallax = 0.0;
  return options;
}

LocalMapOptions noFurtherKeyframe() {
  LocalMapOptions options;
  options.keyframe_parallax = 500.0;
  options.keyframe_overlap = 0.0;
  return options;
}

TEST(LocalMap, IsContinuedByTheSameCameraAndKindOfDescriptor) {
  const synthetic::World world = someWorld(5);
  LocalMap map({});
  const StereoFeatures features = see(world, 0, 5, kOrigin);
  add(map, features, 1, kOrigin, {});
  EXPECT_TRUE(map.continuedBy(features));
  const auto continuedWith = [&](const std::function<void(StereoFeatures&)>& change) {
    StereoFeatures other = features;
    change(other);
    return map.continuedBy(other);
  };
  EXPECT_FALSE(continuedWith([](StereoFeatures& f) { f.camera.baseline = 0.4; }));
  EXPECT_FALSE(continuedWith([](StereoFeatures& f) { f.descriptor = "orb"; }));
  EXPECT_FALSE(continuedWith([](StereoFeatures& f) { f.layout = DescriptorLayout::kLeft; }));
  EXPECT_FALSE(continuedWith([](StereoFeatures& f) { f.element_type = ElementType::kUint8; }));
  EXPECT_FALSE(continuedWith([](StereoFeatures& f) { f.descriptors = f.descriptors.colRange(0, 64).clone(); }));
  EXPECT_TRUE(map.continuedBy(synthetic::noFeatures(synthetic::camera(), 0, 64))) << "no features, no other kind";
}

TEST(LocalMap, MovesTheNewestPairToWhereItsFeaturesAreNow) {
  const synthetic::World world = someWorld(20);
  const Eigen::Isometry3d second = translated(0.1, 0.0, -0.4), moved = translated(0.12, 0.03, -0.45);
  LocalMap map(everyPairAKeyframe()), expected(everyPairAKeyframe());
  for (LocalMap* each : {&map, &expected}) add(*each, see(world, 0, 10, kOrigin), 1, kOrigin, {});
  // Ten points are seen again, ten are new.
  const StereoFeatures before = see(world, 0, 20, second), now = see(world, 0, 20, moved);
  add(map, before, 2, second, recognised(map, before, 10));
  add(expected, now, 2, second, recognised(expected, now, 10));
  map.moveNewest(before, now, RigCalibration());
  const std::vector<Eigen::Vector3d> positions = map.positions(), all = expected.positions();
  ASSERT_EQ(positions.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) EXPECT_LT((positions[i] - all[i]).norm(), 1e-6 * all[i].norm());
  WindowOptimizer optimizer{WindowOptimizerOptions()};
  RigCalibration calibration;
  for (LocalMap* each : {&map, &expected}) ASSERT_TRUE(each->adjust(optimizer, {}, calibration).success);
  EXPECT_TRUE(map.newestPose().isApprox(expected.newestPose(), 1e-6));
  EXPECT_FALSE(map.newestPose().isApprox(second, 1e-3));
}

TEST(LocalMap, ViewIsWhatTheNewestPairSees) {
  const synthetic::World world = someWorld(20);
  LocalMap map({});
  Vector6d xi;
  xi << 0.3, -0.1, 0.5, 0.02, -0.05, 0.03;
  const Eigen::Isometry3d first = expSE3(xi), second = translated(0.0, 0.0, -0.4) * first;
  for (const int id : {1, 2}) {
    StereoFeatures features = see(world, 0, 20, id == 1 ? first : second);
    features.stamp = 42 + id;
    add(map, features, id, id == 1 ? first : second, id == 1 ? Sightings{} : recognised(map, features, 20));
    EXPECT_EQ(map.newestStamp(), 42 + id);
    EXPECT_EQ(map.newestId(), id);
    const Eigen::Isometry3d newest = map.newestPose();
    const LocalMap::View view = map.view();
    ASSERT_EQ(view.points.count(), 20);
    EXPECT_EQ(view.points.kind, features.kind());
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d truth = newest * world.points[i];
      EXPECT_LT((view.points.positions[i] - truth).norm(), 1e-4);
      const Eigen::Vector3d pixel = features.camera.project(truth);
      EXPECT_NEAR(view.pixels[i].x, pixel.x(), 1e-3);
      EXPECT_NEAR(view.pixels[i].y, pixel.y(), 1e-3);
      EXPECT_NEAR(view.pixels[i].z, pixel.x() - pixel.z(), 1e-3);
      EXPECT_EQ(view.ids[i], i);
      EXPECT_EQ(0, std::memcmp(view.points.descriptors.ptr(i), world.rows[i].data(), world.rows[i].size()));
    }
  }
}

TEST(LocalMap, PointsAreWithoutTheRigsError) {
  const synthetic::World world = someWorld(20);
  StereoFeatures features = see(world, 0, 20, kOrigin);
  RigCalibration calibration;
  calibration.value << 0.5, -2.0, 1.0;
  for (int i = 0; i < 20; ++i) {
    const double x = (features.u[i] - features.camera.cx) / features.camera.fx;
    const double y = (features.v[i] - features.camera.cy) / features.camera.fy;
    features.disparity[i] += static_cast<float>(0.5 - 2.0 * x * x + y);
  }
  LocalMap map({});
  add(map, features, 1, kOrigin, {}, calibration);
  const LocalMap::View view = map.view();
  for (int i = 0; i < 20; ++i) EXPECT_LT((view.points.positions[i] - world.points[i]).norm(), 1e-4);
}

TEST(LocalMap, FarPointsAreDirections) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  std::mt19937 random(1);
  synthetic::addFeature(features, 422.5, 236.25, 0.01, synthetic::randomRow(random, 128));
  LocalMap map({});
  add(map, features, 1, kOrigin, {});
  const Eigen::Vector3d position = map.view().points.positions.at(0);
  EXPECT_NEAR(position.z(), 400.0 * 0.5 / 0.05, 1e-2) << "farther than that cannot be told apart";
  EXPECT_NEAR(position.x() / position.z(), 0.25, 1e-9);
}

bool isSeen(const Eigen::Isometry3d& T_camera_origin, const Eigen::Vector3d& point) {
  const Eigen::Vector3d here = T_camera_origin * point;
  return here.z() > 0.0 && synthetic::camera().sees(synthetic::camera().project(here));
}

TEST(LocalMap, DoesNotShowWhatLiesBehind) {
  const synthetic::World world = someWorld(100);
  LocalMap map(noFurtherKeyframe());
  add(map, see(world, 0, 100, kOrigin), 1, kOrigin, {});
  const Eigen::Isometry3d ahead = translated(0.0, 0.0, -10.0);
  add(map, synthetic::noFeatures(synthetic::camera()), 2, ahead, {});
  int in_front = 0, shown = 0;
  for (const Eigen::Vector3d& point : world.points) {
    in_front += (ahead * point).z() > 0.0;
    shown += isSeen(ahead, point);
  }
  ASSERT_LT(in_front, 90);
  ASSERT_LT(shown, in_front);
  ASSERT_GT(shown, 5);
  EXPECT_EQ(map.view().points.count(), shown) << "nor what lies beside the image";
}

TEST(LocalMap, ShowsWhatATurnBringsIntoTheNextImage) {
  const synthetic::World world = someWorld(100);
  LocalMap map(noFurtherKeyframe());
  add(map, see(world, 0, 100, kOrigin), 1, kOrigin, {});
  const Eigen::Isometry3d away(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY()));
  const Eigen::Isometry3d back(Eigen::AngleAxisd(-0.3, Eigen::Vector3d::UnitY()));
  add(map, synthetic::noFeatures(synthetic::camera()), 2, away, {});
  int now = 0, now_or_next = 0;
  for (const Eigen::Vector3d& point : world.points) {
    now += isSeen(away, point);
    now_or_next += isSeen(away, point) || isSeen(back * away, point);
  }
  ASSERT_GT(now_or_next, now + 10);
  EXPECT_EQ(map.view().points.count(), now);
  const LocalMap::View next = map.view(back);
  EXPECT_EQ(next.points.count(), now_or_next);
  for (int row = 0; row < next.points.count(); ++row) {
    const Eigen::Vector3d& expected = world.points[static_cast<std::size_t>(next.ids[row])];
    EXPECT_LT((away.inverse() * next.points.positions[row] - expected).norm(), 1e-3 * expected.norm());
  }
}

TEST(LocalMap, ForgetsThePairBeforeUnlessItWasAKeyframe) {
  const synthetic::World world = someWorld(30);
  LocalMap map(noFurtherKeyframe());
  const Eigen::Isometry3d& pose = kOrigin;
  add(map, see(world, 0, 10, pose), 1, pose, {});
  EXPECT_TRUE(map.newestIsKeyframe()) << "the first one is";
  StereoFeatures second = see(world, 0, 20, pose);
  add(map, second, 2, pose, recognised(map, second, 10));
  EXPECT_FALSE(map.newestIsKeyframe());
  EXPECT_EQ(map.view().points.count(), 20);
  // The third sees five of the points that only the second had shown; the other five go with it.
  StereoFeatures third = see(world, 0, 15, pose);
  add(map, third, 3, pose, recognised(map, third, 15));
  EXPECT_EQ(map.view().points.count(), 15);
  EXPECT_EQ(map.oldestId(), 1);
  EXPECT_EQ(map.newestId(), 3);
  EXPECT_EQ(map.lastKeyframeId(), 1);
}

TEST(LocalMap, KeepsAPairWhosePointsMovedFarEnough) {
  // All points 8 m away: a step of 2 cm across moves them by a pixel.
  synthetic::World world = someWorld(21);
  for (Eigen::Vector3d& point : world.points) point.z() = 8.0;
  LocalMapOptions options;
  options.keyframe_parallax = 4.0;
  for (const bool vertical : {false, true})
    for (const double pixels : {3.9, 4.1}) {
      LocalMap map(options);
      const Eigen::Isometry3d first = Eigen::Isometry3d::Identity();
      const Eigen::Isometry3d moved =
          vertical ? translated(0.0, pixels * 8.0 / 410.0, 0.0) : translated(pixels * 8.0 / 400.0, 0.0, 0.0);
      add(map, see(world, 0, 21, first), 1, first, {});
      StereoFeatures second = see(world, 0, 21, moved);
      // A fifth of them far off: the median decides.
      for (int i = 0; i < 4; ++i) second.u[i] += 40.f;
      for (float& disparity : second.disparity) disparity += 10.f;  // that is no parallax
      add(map, second, 2, moved, recognised(map, second, 21));
      EXPECT_EQ(map.newestIsKeyframe(), pixels > 4.0) << pixels;
      EXPECT_EQ(map.lastKeyframeId(), pixels > 4.0 ? 2 : 1);
    }
}

TEST(LocalMap, KeepsAPairOnceFewOfItsPointsWereInTheLastKeyframe) {
  const synthetic::World world = someWorld(40);
  const Eigen::Isometry3d& pose = kOrigin;
  for (const int old : {11, 13}) {
    LocalMapOptions options = noFurtherKeyframe();
    options.keyframe_overlap = 0.6;
    LocalMap map(options);
    add(map, see(world, 0, 13, pose), 1, pose, {});
    StereoFeatures second = see(world, 0, 21, pose);  // eight new ones
    add(map, second, 2, pose, recognised(map, second, 13));
    ASSERT_FALSE(map.newestIsKeyframe());
    // The third recognises the eight and `old` of the first pair: 11 of 19 is less than 0.6, 13 of 21 is not.
    const LocalMap::View view = map.view();
    StereoFeatures third = see(world, 13 - old, 21, pose);
    Sightings sightings;
    for (int row = 0; row < third.count(); ++row) sightings.push_back(sighting(map, view, 13 - old + row, third, row));
    add(map, third, 3, pose, sightings);
    EXPECT_EQ(map.newestIsKeyframe(), old == 11);
  }
}

TEST(LocalMap, HoldsAsManyKeyframesAsItIsTold) {
  const synthetic::World world = someWorld(20);
  LocalMapOptions options = everyPairAKeyframe();
  options.keyframes = 3;
  options.min_shared_points = 21;  // more than there are
  LocalMap map(options);
  for (int id = 1; id <= 6; ++id) {
    const Eigen::Isometry3d pose = translated(0.1 * id, 0.0, 0.0);
    const StereoFeatures features = see(world, 0, 20, pose);
    add(map, features, id, pose, id == 1 ? Sightings{} : recognised(map, features, 20));
    EXPECT_TRUE(map.newestIsKeyframe());
    EXPECT_EQ(map.oldestId(), std::max(1, id - 3)) << "three beside the newest";
  }
}

TEST(LocalMap, HoldsAnOldKeyframeWhileItSharesEnough) {
  constexpr int kPoints = 80;
  struct Case {
    int min_shared_points, shared;
    bool stays;
  };
  for (const auto& [min_shared_points, shared, stays] :
       {Case{20, 20, true}, Case{20, 19, false}, Case{5, 5, true}, Case{5, 4, false}}) {
    const synthetic::World world = someWorld(2 * kPoints);
    LocalMapOptions options = everyPairAKeyframe();
    options.keyframes = 2;
    options.min_shared_points = min_shared_points;
    LocalMap map(options);
    add(map, see(world, kPoints, 2 * kPoints, translated(0.1, 0.0, 0.0)), 1, translated(0.1, 0.0, 0.0), {});
    for (int id = 2; id <= 4; ++id) {
      const Eigen::Isometry3d pose = translated(0.1 * id, 0.0, 0.0);
      const StereoFeatures features = see(world, shared, kPoints + shared, pose);
      const LocalMap::View view = map.view();
      Sightings sightings;
      // Those of the first pair are the map's first; the second pair adds all others.
      for (int row = id == 2 ? kPoints - shared : 0; row < kPoints; ++row) {
        const int of_first = row - (kPoints - shared);
        sightings.push_back(sighting(map, view, of_first >= 0 ? of_first : kPoints + row, features, row));
      }
      add(map, features, id, pose, sightings);
    }
    EXPECT_EQ(map.oldestId(), stays ? 1 : 2) << shared << " of 80 points, " << min_shared_points << " asked for";
  }
}

TEST(LocalMap, LooksForAPointUntilEnoughFramesMissedIt) {
  const synthetic::World world = someWorld(20);
  LocalMap map(everyPairAKeyframe());
  add(map, see(world, 0, 20, translated(0.0, 0.0, 0.0)), 1, translated(0.0, 0.0, 0.0), {});
  for (int id = 2; id <= 5; ++id) {
    EXPECT_EQ(map.view().points.count(), 20) << "before pair " << id;
    const Eigen::Isometry3d pose = translated(0.1 * id, 0.0, 0.0);
    const StereoFeatures features = see(world, 0, 10, pose);
    add(map, features, id, pose, recognised(map, features, 10));
  }
  EXPECT_EQ(map.view().points.count(), 10) << "pairs 2 to 5 missed the others";
}

TEST(LocalMap, TakesTheAppearanceOfTheLastSighting) {
  const synthetic::World world = someWorld(20), other_looks = someWorld(20, 2);
  LocalMap map(noFurtherKeyframe());
  const Eigen::Isometry3d& pose = kOrigin;
  add(map, see(world, 0, 20, pose), 1, pose, {});
  StereoFeatures second = see(world, 0, 20, pose);
  for (int i = 0; i < 20; ++i) std::memcpy(second.descriptors.ptr(i), other_looks.rows[i].data(), 128);
  add(map, second, 2, pose, recognised(map, second, 12));
  const LocalMap::View view = map.view();
  ASSERT_EQ(view.points.count(), 28) << "the other eight rows are new points";
  for (int i = 0; i < 28; ++i) {
    const auto& looks = i < 12 ? other_looks.rows[i] : i < 20 ? world.rows[i] : other_looks.rows[i - 8];
    EXPECT_EQ(0, std::memcmp(view.points.descriptors.ptr(i), looks.data(), looks.size())) << i;
  }
}

/// The rig's error is known to be none.
CalibrationBelief noRigError() {
  return {RigCalibration::Vector::Zero(), 1e12 * RigCalibration::Matrix::Identity()};
}

LocalMap::Adjustment adjusted(LocalMap& map) {
  RigCalibration calibration;
  WindowOptimizer optimizer({{}, 20});
  const LocalMap::Adjustment adjustment = map.adjust(optimizer, noRigError(), calibration);
  EXPECT_TRUE(adjustment.success);
  EXPECT_LT(calibration.value.norm(), 1e-6);
  return adjustment;
}

TEST(LocalMap, AdjustmentMovesTheNewestPairToWhereItsPointsSayItIs) {
  const synthetic::World world = someWorld(60);
  LocalMap map(everyPairAKeyframe());
  const Eigen::Isometry3d second = translated(0.1, 0.02, -0.5);
  add(map, see(world, 0, 60, kOrigin), 1, kOrigin, {});
  const StereoFeatures features = see(world, 0, 60, second);
  Vector6d error;
  error << 0.03, -0.02, 0.04, 0.002, -0.003, 0.004;
  map.insert(features, 2, expSE3(error) * second, recognised(map, features, 60), {});
  EXPECT_TRUE(adjusted(map).rejected.empty());
  EXPECT_LT(logSE3(map.newestPose() * second.inverse()).norm(), 1e-4);
}

/// A corner that nothing is ever aligned with weighs as much as those seen later, whether it has a patch or not.
TEST(LocalMap, PatchesThatAreNotAlignedChangeNothing) {
  const auto poseAfter = [&](int patch_side) {
    const synthetic::World world = someWorld(60);
    LocalMap map(everyPairAKeyframe());
    const Eigen::Isometry3d second = translated(0.1, 0.02, -0.5);
    const auto seeNoisily = [&](const Eigen::Isometry3d& pose) {
      StereoFeatures features = see(world, 0, 60, pose);
      for (std::size_t i = 0; i < features.u.size(); ++i) features.u[i] += i % 3 == 0 ? 0.6f : -0.2f;
      if (patch_side > 0) {
        features.patch_layout = {patch_side, 1.f, 0.f};
        features.patches = cv::Mat::zeros(features.count(), features.patch_layout.bytes(), CV_8U);
      }
      return features;
    };
    map.insert(seeNoisily(kOrigin), 1, kOrigin, {}, RigCalibration());
    const StereoFeatures features = seeNoisily(second);
    map.insert(features, 2, second, recognised(map, features, 60), {});
    adjusted(map);
    return map.newestPose().matrix();
  };
  EXPECT_EQ(poseAfter(9), poseAfter(0)) << "too small to be aligned";
  EXPECT_NE(poseAfter(13), poseAfter(0));
}

TEST(LocalMap, APointKeepsItsAppearanceWhenASightingTurnsOutWrong) {
  const synthetic::World world = someWorld(60);
  LocalMap map(everyPairAKeyframe());
  const Eigen::Isometry3d second = translated(0.1, 0.02, -0.5);
  add(map, see(world, 0, 60, kOrigin), 1, kOrigin, {});
  StereoFeatures features = see(world, 0, 60, second);
  std::mt19937 random(9);
  const std::vector<std::uint8_t> strange = synthetic::randomRow(random, 128);
  features.u[17] += 30.f;  // another thing, that looked like point 17
  std::memcpy(features.descriptors.ptr(17), strange.data(), strange.size());
  const Sightings sightings = recognised(map, features, 60);
  map.insert(features, 2, second, sightings, {});
  EXPECT_EQ(adjusted(map).rejected, std::vector<int>{17});
  map.renewAppearance(features, sightings);

  const LocalMap::View view = map.view();
  ASSERT_EQ(view.points.count(), 60);
  EXPECT_EQ(0, std::memcmp(view.points.descriptors.ptr(17), world.rows[17].data(), 128));
  EXPECT_LT((view.points.positions[17] - second * world.points[17]).norm(), 0.02);
}

/// Frames 2 and 3, a step and a turn apart, know each other well by forty points, and together know hardly where frame
/// 1 is: what the map says of the motion from 2 to 3 must be what a map of these two alone says.
TEST(LocalMap, CovarianceBetweenTwoFramesDoesNotDependOnWhereTheFirstOneIs) {
  const synthetic::World world = someWorld(40);
  Vector6d step;
  step << 0.4, -0.2, -0.6, 0.03, 0.12, -0.05;
  const Eigen::Isometry3d second = translated(0.2, 0.0, -0.5), third = expSE3(step) * second;
  LocalMapOptions options = everyPairAKeyframe();
  options.noise.corner = 0.05;
  NoiseOptions noise;
  noise.common_disparity = 0.0;
  WindowOptimizer optimizer({noise});
  RigCalibration calibration;
  constexpr double kNoise = 0.05;  // px
  const StereoFeatures of_second = see(world, 0, 40, second, kNoise, 2), of_third = see(world, 0, 40, third, kNoise, 3);

  LocalMap alone(options);
  add(alone, of_second, 2, second, {});
  alone.insert(of_third, 3, third, recognised(alone, of_third, 40), {});
  const LocalMap::Adjustment known = alone.adjust(optimizer, noRigError(), calibration);
  ASSERT_TRUE(known.success);

  LocalMap map(options);
  add(map, see(world, 0, 12, kOrigin), 1, kOrigin, {});
  Sightings loose = recognised(map, of_second, 12);
  for (LocalMap::Sighting& sighting : loose) sighting.sigma = 20.0;
  // The rows come a second time as points of the second frame's own.
  StereoFeatures twice = of_second;
  for (int i = 0; i < 12; ++i) {
    twice.append({of_second.u[i], of_second.v[i], of_second.disparity[i], 0.f, 10.f, -1.f, 1.f});
    twice.descriptors.push_back(of_second.descriptors.row(i));
  }
  add(map, twice, 2, second, loose);
  // View: 12 points of the first frame, then rows 12 … 39 and the twelve again.
  const LocalMap::View view = map.view();
  ASSERT_EQ(view.points.count(), 52);
  Sightings sightings;
  for (int i = 0; i < 40; ++i) sightings.push_back(sighting(map, view, 12 + i, of_third, i < 28 ? 12 + i : i - 28));
  map.insert(of_third, 3, third, sightings, {});
  const LocalMap::Adjustment adjustment = map.adjust(optimizer, noRigError(), calibration);
  ASSERT_TRUE(adjustment.success);
  // But for a factor: residuals of loose sightings are smaller than expected.
  const Matrix6d root = known.since_keyframe.llt().matrixL();
  const Matrix6d ratio = root.inverse() * adjustment.since_keyframe * root.inverse().transpose();
  const double factor = ratio.trace() / 6.0;
  EXPECT_GT(factor, 0.1);
  EXPECT_LT(factor, 1.1);
  EXPECT_LT((ratio / factor - Matrix6d::Identity()).norm(), 0.05) << ratio;
}

/// A camera hovers in front of the same points, which every key frame sees: its pose errs by what the map errs, however
/// many key frames there were.
TEST(LocalMap, APoseErrsByWhatItsCovarianceSaysAfterManyKeyframesOfTheSamePoints) {
  constexpr double kNoise = 0.3;  // px
  constexpr int kTrials = 12, kPairs = 24;
  LocalMapOptions options = everyPairAKeyframe();
  options.noise.corner = kNoise;
  options.noise.disparity = std::sqrt(2.0) * kNoise;
  options.noise.common_disparity = 0.0;
  WindowOptimizer optimizer({options.noise, 20});
  double nees = 0.0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const synthetic::World world = someWorld(80, trial);
    LocalMap map(options);
    PoseCovariance covariance;
    RigCalibration calibration;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (int pair = 0; pair < kPairs; ++pair) {
      const Eigen::Isometry3d before = pair == 0 ? pose : map.newestPose();
      pose = translated(0.3 * std::sin(0.5 * pair), 0.0, 0.2 * std::cos(0.5 * pair) - 0.2);
      const StereoFeatures features = see(world, 0, 80, pose, kNoise, 100 * trial + static_cast<unsigned>(pair));
      add(map, features, pair, pose, pair == 0 ? Sightings{} : recognised(map, features, 80));
      if (pair == 0) continue;
      const LocalMap::Adjustment adjustment = map.adjust(optimizer, noRigError(), calibration);
      ASSERT_TRUE(adjustment.success);
      covariance.update(before * map.newestPose().inverse(), adjustment.since_keyframe, adjustment.growth);
      covariance.markKeyframe();
    }
    const Vector6d error = logSE3(pose * map.newestPose().inverse());
    nees += mahalanobisSquare(error, covariance.value()) / kTrials;
  }
  EXPECT_GT(nees, 3.0);  // chi-square of six
  EXPECT_LT(nees, 12.0);
}

}  // namespace sdvo::test_local_map
