#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "../../src/rig/row_readout.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_row_readout {

constexpr double kInterval = 0.05;  // s

/// Rate of a camera that turns slowly and shakes, rad/s.
Eigen::Vector3d rateAt(double time) {
  return {0.3 * std::sin(9.0 * time), std::cos(5.0 * time), 0.2 * std::sin(13.0 * time)};
}

Eigen::Isometry3d motionSince(double time) {
  constexpr int kSteps = 20;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int k = 0; k < kSteps; ++k) {
    Vector6d velocity;
    velocity << 0.2, 0.0, 0.5, rateAt(time + (k + 0.5) / kSteps * kInterval);
    T = T * expSE3(Vector6d(kInterval / kSteps * velocity));
  }
  return T;
}

struct Watched : RowReadout {
  std::vector<double> variances{};  ///< rad^2, of each pair's turn, by what is unknown of the readout
};

/// 80 pairs, seen with a readout, s, and 0.3 px of noise. Half of the points of each are seen in the next one, too.
Watched watched(double readout) {
  constexpr int kPoints = 200;
  const StereoCamera camera = synthetic::camera();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Watched result;
  std::vector<Eigen::Vector3d> old, now;  // points in the last camera's frame, in this one's
  StereoFeatures before;
  for (int pair = 0; pair < 80; ++pair) {
    MotionHypothesis found;
    found.motion.T_current_reference = motionSince((pair - 1) * kInterval).inverse();
    auto view = std::make_shared<LocalMap::View>();
    now.clear();
    for (const Eigen::Vector3d& point : old) now.push_back(found.motion.T_current_reference * point);
    const std::size_t seen_again = now.size();
    for (int i = 0; i < kPoints; ++i)
      now.push_back(camera.backProject(camera.width * uniform(random), camera.height * uniform(random),
                                       10.0 + 30.0 * uniform(random)));
    StereoFeatures features;
    features.camera = camera;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double late = readout * ((camera.project(now[i]).y() + 0.5) / camera.height - 0.5);
      Vector6d turned = Vector6d::Zero();
      turned.tail<3>() = late * rateAt(pair * kInterval);
      const Eigen::Vector3d pixel = camera.project(expSE3(turned).inverse() * now[i]);
      features.u.push_back(static_cast<float>(pixel.x() + 0.3 * normal(random)));
      features.v.push_back(static_cast<float>(pixel.y() + 0.3 * normal(random)));
      features.disparity.push_back(static_cast<float>(camera.disparity(now[i].z())));
      if (i >= seen_again) continue;
      const int k = before.count() - kPoints + static_cast<int>(i);
      view->pixels.emplace_back(before.u[k], before.v[k], before.disparity[k]);
      view->newest.push_back(k);
      found.matches.push_back({static_cast<int>(i), static_cast<int>(i), 0.f});
    }
    found.view = view;
    const double compensated = result.usableValue();
    result.variances.push_back(
        result.momentOf(features, found, kInterval, compensated).bottomRightCorner<3, 3>().trace());
    result.add(features, found, kInterval);
    before = features;
    old.assign(now.end() - kPoints, now.end());
  }
  return result;
}

TEST(RowReadout, FindsARollingShutter) {
  for (const double readout : {0.01, 0.025, -0.017}) {
    const auto found = watched(readout).estimate();
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->value, readout, 0.001);
    EXPECT_LT(std::abs(found->value - readout), 3.0 * found->sigma);
    EXPECT_LT(found->sigma, 0.003);
    EXPECT_TRUE(found->isRolling());
  }
}

TEST(RowReadout, MotionsContainWhatIsUnknownOfIt) {
  for (const double readout : {0.0, 0.025}) {
    const std::vector<double> variances = watched(readout).variances;
    const double at_first = *std::max_element(variances.begin(), variances.begin() + 10);
    const double at_last = *std::max_element(variances.end() - 10, variances.end());
    EXPECT_GT(std::sqrt(at_first), 5e-4) << "rad: a quarter of 14 ms times a change of the rate by 0.2 rad/s";
    EXPECT_LT(std::sqrt(at_last), 0.2 * std::sqrt(at_first)) << readout;
  }
}

TEST(RowReadout, AGlobalShutterIsNone) {
  const auto found = watched(0.0).estimate();
  ASSERT_TRUE(found);
  EXPECT_LT(std::abs(found->value), 4.0 * found->sigma);
  EXPECT_FALSE(found->isRolling());
  EXPECT_FALSE(RowReadout().estimate());
}

}  // namespace sdvo::test_row_readout
