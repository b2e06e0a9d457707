#include <gtest/gtest.h>

#include <memory>

#include "../../src/rig/rolling_shutter.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_rolling_shutter {

constexpr double kReadout = 0.025, kPeriod = 0.05;  // s
constexpr double kAcceleration = 1.4;               // rad/s within a second

CalibrationOptions rolling() {
  CalibrationOptions options;
  options.readout = kReadout;
  return options;
}

Vector6d turning() {
  Vector6d velocity;
  velocity << 0.3, -0.2, 0.8, 0.3, -1.2, 0.5;
  return velocity;
}

/// Points all over the image, at many depths, in the camera's frame at the stamp.
std::vector<Eigen::Vector3d> pointsOf(const StereoCamera& camera) {
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < 12; ++row)
    for (int column = 0; column < 16; ++column)
      points.push_back(camera.backProject(camera.width * (column + 0.5) / 16.0, camera.height * (row + 0.5) / 12.0,
                                          20.0 + 3.0 * ((5 * row + 3 * column) % 9)));
  return points;
}

/// The points as rows that are taken one after the other show them to a camera of this velocity.
StereoFeatures rolled(const Vector6d& velocity, double readout) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  const StereoCamera& camera = features.camera;
  for (const Eigen::Vector3d& point : pointsOf(camera)) {
    Eigen::Vector3d pixel = camera.project(point);
    for (int iteration = 0; iteration < 20; ++iteration) {
      const double time = readout * ((pixel.y() + 0.5) / camera.height - 0.5);
      pixel = camera.project(expSE3(time * velocity).inverse() * point);
    }
    features.append({static_cast<float>(pixel.x()), static_cast<float>(pixel.y()),
                     static_cast<float>(pixel.x() - pixel.z()), 0.f, 10.f, -1.f, 1.f});
  }
  return features;
}

TEST(RollingShutter, TakesTheMiddleRowAtTheStamp) {
  const StereoCamera camera = synthetic::camera();
  EXPECT_DOUBLE_EQ(rowTime(camera, 0.5 * camera.height - 0.5), 0.0);
  EXPECT_DOUBLE_EQ(rowTime(camera, -0.5), -0.5);
  EXPECT_DOUBLE_EQ(rowTime(camera, camera.height - 0.5), 0.5);
  EXPECT_FALSE(RollingShutter({}, kAcceleration).isRolling());
}

TEST(RollingShutter, MovesPointsToWhereAGlobalOneSeesThem) {
  for (const double readout : {kReadout, -kReadout}) {
    const StereoFeatures global = RollingShutter::asGlobal({rolled(turning(), readout), readout, turning()});
    const std::vector<Eigen::Vector3d> points = pointsOf(global.camera);
    for (int i = 0; i < global.count(); ++i)
      EXPECT_LT((global.measurement(i) - global.camera.project(points[static_cast<std::size_t>(i)])).norm(), 1e-3);
  }
}

/// The pair, found without a motion of its own, in a map that has the points right.
MotionHypothesis foundIn(const StereoFeatures& global) {
  MotionHypothesis found;
  auto view = std::make_shared<LocalMap::View>();
  view->points.positions = pointsOf(global.camera);
  found.view = view;
  for (int i = 0; i < global.count(); ++i) {
    found.matches.push_back({i, i, 0.f});
    found.motion.inliers.push_back(i);
    found.sightings.push_back({{{global.u[i], global.v[i], global.disparity[i]}, 0.1}, i, i});
  }
  return found;
}

TEST(RollingShutter, RowsShowTheRateAtTheStamp) {
  const RollingShutter shutter(rolling(), kAcceleration);
  Vector6d assumed = turning();
  assumed.tail<3>() += Eigen::Vector3d(0.05, -0.08, 0.04);
  const RolledPair pair{rolled(turning(), kReadout), kReadout, assumed};
  const auto rate = shutter.rateByRows(pair, foundIn(shutter.asGlobal(pair)));
  ASSERT_TRUE(rate);
  EXPECT_LT((rate->value - turning().tail<3>()).norm(), 0.002);
  EXPECT_LT(std::sqrt(rate->covariance.trace()), 0.02);
}

TEST(RollingShutter, FewPointsShowNoRate) {
  const RollingShutter shutter(rolling(), kAcceleration);
  const RolledPair pair{rolled(turning(), kReadout), kReadout, turning()};
  MotionHypothesis found = foundIn(shutter.asGlobal(pair));
  found.sightings.clear(), found.motion.inliers.clear();
  EXPECT_FALSE(shutter.rateByRows(pair, found));
}

TEST(RollingShutter, TheVelocityIsBetweenTheMotionsAroundIt) {
  const RollingShutter shutter(rolling(), kAcceleration);
  RolledPair pair;
  EXPECT_EQ(shutter.velocityAt(pair), Vector6d::Zero());
  EXPECT_EQ(shutter.velocityBetween(pair, turning()), turning());
  pair.mean_velocity = turning(), pair.dt = kPeriod;
  EXPECT_EQ(shutter.velocityAt(pair), turning());
  EXPECT_TRUE(shutter.velocityBetween(pair, 2.0 * turning()).isApprox(1.5 * turning()));
  pair.mean_velocity_before = 0.6 * turning();
  EXPECT_TRUE(shutter.velocityAt(pair).isApprox(1.1 * turning()));
}

TEST(RollingShutter, WeighsRowsByHowUnevenMotionsAre) {
  const Eigen::Vector3d more(0.1, 0.1, 0.1);
  const auto expected_and_rows = [&](const Vector6d& unevenness) {
    RollingShutter shutter(rolling(), kAcceleration);
    RolledPair pair;
    pair.mean_velocity = turning(), pair.mean_velocity_before = turning(), pair.dt = kPeriod;
    for (int k = 0; k < 100; ++k) shutter.learn(pair, turning() + (k % 2 == 0 ? 1.0 : -1.0) * unevenness);
    pair.rate_by_rows = RateByRows{turning().tail<3>() + more, 1e-4 * Eigen::Matrix3d::Identity(),
                                   Eigen::Matrix<double, 6, 3>::Constant(0.01)};
    EXPECT_GE(shutter.covarianceByVelocity(pair).trace(), 0.0);
    return (shutter.velocityAt(pair) - turning()).tail<3>().norm() / more.norm();
  };
  EXPECT_LT(expected_and_rows(Vector6d::Constant(1e-4)), 0.05);
  EXPECT_GT(expected_and_rows(Vector6d::Constant(0.5)), 0.95);
}

}  // namespace sdvo::test_rolling_shutter
