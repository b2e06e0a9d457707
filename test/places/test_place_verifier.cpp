#include <gtest/gtest.h>

#include "../../src/places/place_verifier.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_place_verifier {

using synthetic::camera;

const synthetic::World kWorld = synthetic::randomWorld(1, 500, {-8.0, -4.0, 4.0}, {8.0, 4.0, 25.0});

Eigen::Isometry3d pose(const Eigen::Vector3d& translation, double turn) {
  return Eigen::Translation3d(translation) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY());
}

StereoFeatures see(const synthetic::World& world, const Eigen::Isometry3d& T_world_camera, unsigned seed) {
  synthetic::Sighting sighting;
  sighting.noise = 0.3;
  sighting.flipped = 0.1;
  sighting.strangers = 100;
  sighting.seed = seed;
  return synthetic::observe(world, camera(), T_world_camera.inverse(), 0, sighting);
}

TEST(PlaceVerifier, TellsFromWhereThePlaceIsSeenNowAndHowWellItKnows) {
  const PlaceVerifier verifier;
  double sum = 0.0;
  constexpr int kTrials = 20;
  for (int i = 0; i < kTrials; ++i) {
    const Eigen::Isometry3d T_world_place = pose({0.3, 0.0, 0.1 * i}, 0.05),
                            T_world_camera = pose({-1.0, 0.1, 1.5}, -0.15);
    const PlaceMatch match =
        verifier.verify(see(kWorld, T_world_place, 2 * i + 1), see(kWorld, T_world_camera, 2 * i + 2));
    ASSERT_TRUE(match.same) << match.reason;
    EXPECT_GE(match.inliers, 100);
    const Eigen::Isometry3d T_true = T_world_place.inverse() * T_world_camera;
    const Vector6d error = logSE3(match.T_place_camera.inverse() * T_true);
    EXPECT_LT(error.head<3>().norm(), 0.1);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
    sum += mahalanobisSquare(error, match.covariance);
  }
  EXPECT_GT(sum / kTrials, 3.0);
  EXPECT_LT(sum / kTrials, 18.0);
}

TEST(PlaceVerifier, AnotherPlaceIsNotTheSame) {
  const synthetic::World other = synthetic::randomWorld(2, 500, {-8.0, -4.0, 4.0}, {8.0, 4.0, 25.0});
  const PlaceMatch match =
      PlaceVerifier().verify(see(kWorld, pose({0, 0, 0}, 0.0), 1), see(other, pose({0, 0, 0}, 0.0), 2));
  EXPECT_FALSE(match.same);
  EXPECT_FALSE(match.reason.empty());
}

/// The same board carried elsewhere: what is on it matches, but only there.
TEST(PlaceVerifier, AThingInACornerIsNoPlace) {
  synthetic::World here = synthetic::randomWorld(2, 300, {-8.0, -4.0, 6.0}, {8.0, 4.0, 25.0}),
                   there = synthetic::randomWorld(3, 300, {-8.0, -4.0, 6.0}, {8.0, 4.0, 25.0});
  const synthetic::World thing = synthetic::randomWorld(4, 80, {1.0, -1.0, 5.0}, {2.0, 0.0, 6.0});
  for (synthetic::World* world : {&here, &there}) {
    world->points.insert(world->points.end(), thing.points.begin(), thing.points.end());
    world->rows.insert(world->rows.end(), thing.rows.begin(), thing.rows.end());
  }
  const PlaceMatch match =
      PlaceVerifier().verify(see(here, pose({0, 0, 0}, 0.0), 1), see(there, pose({0.5, 0, 0}, 0.0), 2));
  EXPECT_FALSE(match.same);
  EXPECT_TRUE(contains(match.reason, "small part of the image")) << match.reason;
}

TEST(PlaceVerifier, NothingToSeeIsNoError) {
  const StereoFeatures nothing = synthetic::noFeatures(camera()), some = see(kWorld, pose({0, 0, 0}, 0.0), 1);
  const PlaceVerifier verifier;
  EXPECT_EQ(verifier.verify(nothing, some).reason, "only 0 matches");
  EXPECT_FALSE(verifier.verify(some, nothing).same);
}

}  // namespace sdvo::test_place_verifier
