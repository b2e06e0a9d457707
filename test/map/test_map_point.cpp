#include <gtest/gtest.h>

#include "../../src/map/map_point.hpp"
#include "../synthetic_features.hpp"

namespace sdvo::test_map_point {

StereoCamera someCamera() {
  return SyntheticScene(1, 0, 10.0).camera;
}

TEST(PredictObservation, AgreesWithTheCameraModel) {
  AnchoredPoint point;
  point.T_origin_anchor = syntheticPose(3);
  point.ray_and_inverse_depth = {0.2, -0.1, 1.0 / 12.5};
  const Eigen::Isometry3d T_camera_origin = syntheticPose(5).inverse();
  const Eigen::Vector3d in_camera = T_camera_origin * point.T_origin_anchor * Eigen::Vector3d(2.5, -1.25, 12.5);
  const Eigen::Vector3d projection = someCamera().project(in_camera);
  const auto prediction = predictObservation(someCamera(), T_camera_origin, point);
  ASSERT_TRUE(prediction);
  EXPECT_NEAR(prediction->x(), projection.x(), 1e-9);
  EXPECT_NEAR(prediction->y(), projection.y(), 1e-9);
  EXPECT_NEAR(prediction->z(), projection.x() - projection.z(), 1e-9);
}

TEST(PredictObservation, PointAtInfinityHasNoDisparityAndIgnoresTranslation) {
  AnchoredPoint point;
  point.ray_and_inverse_depth = {0.1, 0.05, 0.0};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(5.0, -3.0, 2.0);
  const auto prediction = predictObservation(someCamera(), T, point);
  ASSERT_TRUE(prediction);
  EXPECT_NEAR((*prediction - Eigen::Vector3d(670.0, 215.0, 0.0)).norm(), 0.0, 1e-9);
}

TEST(PredictObservation, RefusesPointsBehindTheCamera) {
  AnchoredPoint point;
  point.ray_and_inverse_depth = {0.0, 0.0, 0.2};  // 5 m ahead of the origin
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = -6.0;
  EXPECT_FALSE(predictObservation(someCamera(), T, point));
}

}  // namespace sdvo::test_map_point
