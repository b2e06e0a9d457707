#include <gtest/gtest.h>

#include "../../src/rig/right_camera_delay.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo::test_right_camera_delay {

constexpr double kPeriod = 0.05;  // s

/// Points around the camera, as a rig sees them that moves at `velocity` and whose right image is `delay` late.
StereoFeatures seen(const Vector6d& velocity, double delay, double noise = 0.0, unsigned seed = 1) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  const StereoCamera& camera = features.camera;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::Isometry3d T_later_now = expSE3(delay * velocity).inverse();
  for (int row = 0; row < 12; ++row)
    for (int column = 0; column < 16; ++column) {
      const double u = camera.width * (column + 0.5) / 16.0, v = camera.height * (row + 0.5) / 12.0;
      const double disparity = 20.0 + 3.0 * ((5 * row + 3 * column) % 9);
      const Eigen::Vector3d right = camera.project(T_later_now * camera.backProject(u, v, disparity));
      features.append({static_cast<float>(u), static_cast<float>(v), static_cast<float>(u - right.z()),
                       static_cast<float>(right.y() - v + noise * normal(random)), 10.f, -1.f, 1.f});
    }
  return features;
}

/// As the points move in the left image, without delay.
std::vector<RowMotion> rowsOf(const StereoFeatures& features, const Vector6d& velocity) {
  std::vector<RowMotion> rows;
  constexpr double kStep = 1e-3;  // s
  const StereoFeatures later = seen(velocity, kStep), now = seen(velocity, 0.0);
  for (int i = 0; i < features.count(); ++i)
    rows.push_back({(later.dv[i] - now.dv[i]) / kStep, features.dv[i], i % RowDelay::kParts});
  return rows;
}

Vector6d velocityAt(double time) {
  Vector6d velocity;
  velocity << 0.3, 0.1, 0.8, 0.5 * std::sin(5.0 * time), 1.0 + 0.3 * std::cos(3.0 * time), 0.2 * std::sin(4.0 * time);
  return velocity;
}

/// Mean velocity over the interval before the pair.
Vector6d before(int pair) {
  return velocityAt(kPeriod * (pair - 0.5));
}

constexpr double kRowError = 0.4;  // px

/// Pair k, whose rows have noise of 0.1 px, by a right camera that is so late.
void learn(RightCameraDelay& right_delay, int k, double delay, bool is_trusted = true) {
  const double known = right_delay.estimate() ? right_delay.estimate()->value : 0.0;
  right_delay.learn(seen(velocityAt(kPeriod * k + 0.5 * delay), delay, 0.1, 10u + static_cast<unsigned>(k)), kPeriod,
                    before(k), known, is_trusted);
}

RightCameraDelay watched(double delay, int pairs) {
  RightCameraDelay right_delay;
  for (int k = 0; k < pairs; ++k) learn(right_delay, k, delay);
  return right_delay;
}

TEST(RightCameraDelay, PutsFeaturesInStep) {
  for (const double delay : {-0.006, 0.006}) {
    const Vector6d velocity = velocityAt(1.0);
    const StereoFeatures late = seen(velocity, delay), synchronised = seen(velocity, 0.0);
    const StereoFeatures corrected = RightCameraDelay().synchronised(late, kPeriod, velocity, delay);
    for (int i = 0; i < late.count(); ++i) {
      EXPECT_NEAR(corrected.disparity[i], synchronised.disparity[i], 0.02) << late.disparity[i];
      EXPECT_NEAR(corrected.dv[i], 0.0, 0.02) << late.dv[i];
    }
  }
}

TEST(RightCameraDelay, KeepsPointsThatNoiseWouldPutBeyondInfinity) {
  Vector6d turn = Vector6d::Zero();
  turn[4] = -2.0;
  StereoFeatures far = seen(Vector6d::Zero(), 0.0);
  for (float& disparity : far.disparity) disparity = 0.5f;
  const StereoFeatures corrected = RightCameraDelay().synchronised(far, kPeriod, turn, -0.01);
  ASSERT_EQ(corrected.count(), far.count());
  for (const float disparity : corrected.disparity) EXPECT_GT(disparity, 0.f);
}

TEST(RightCameraDelay, FindsADelay) {
  for (const double delay : {-0.0031, 0.0, 0.0062}) {
    const RightCameraDelay found = watched(delay, 60);
    ASSERT_TRUE(found.estimate());
    EXPECT_NEAR(found.estimate()->value, delay, 3e-4);
  }
}

TEST(RightCameraDelay, StampsOfFreeRunningCamerasAreKnownDelays) {
  RightCameraDelay right_delay;
  constexpr double kOffset = 0.003;  // s, of one driver's stamps
  double known = 0.0;
  const auto pair = [](int k, double noise) {
    const double stamped = 1e-3 * (k % 20 - 10), delay = stamped + kOffset;
    StereoFeatures features = seen(velocityAt(kPeriod * k + 0.5 * delay), delay, noise, 10u + static_cast<unsigned>(k));
    features.right_delay = stamped;
    return features;
  };
  for (int k = 0; k < 120; ++k) {
    const StereoFeatures synchronised = seen(velocityAt(kPeriod * k), 0.0);
    const StereoFeatures corrected = right_delay.synchronised(pair(k, 0.0), kPeriod, before(k), known);
    EXPECT_EQ(corrected.right_delay, 0.0);
    constexpr double kHalfAMillisecond = 0.5;  // px, at 1 px/ms
    for (int i = 0; i < synchronised.count() && k >= 100; ++i)
      EXPECT_NEAR(corrected.disparity[i], synchronised.disparity[i], kHalfAMillisecond) << k;
    right_delay.learn(pair(k, 0.1), kPeriod, before(k), known, true);
    if (right_delay.estimate()) known = right_delay.estimate()->value;
  }
  EXPECT_NEAR(known, kOffset, 5e-4);
}

TEST(RightCameraDelay, KnowsThePartnerOfAnotherPair) {
  for (const double delay : {-kPeriod, 0.0, kPeriod, -0.003}) {
    RightCameraDelay right_delay;
    const Vector6d velocity = velocityAt(1.0);
    const StereoFeatures features = seen(velocity, delay, 0.15);
    right_delay.updateOtherPair(rowsOf(features, velocity), kPeriod, kRowError);
    const bool is_another = std::abs(delay) == kPeriod;
    EXPECT_EQ(right_delay.otherPair(kPeriod).log_odds > 0.0, is_another) << delay;
    if (is_another) {
      EXPECT_EQ(right_delay.otherPair(kPeriod).delay, delay);
    }
  }
}

TEST(RightCameraDelay, KnowsThePartnerUntilRowsInStepSayOtherwise) {
  RightCameraDelay right_delay;
  const Vector6d velocity = velocityAt(1.0);
  const auto measure = [&](const StereoFeatures& features, const Vector6d& moved) {
    right_delay.updateOtherPair(rowsOf(features, moved), kPeriod, kRowError);
    return right_delay.otherPair(kPeriod).log_odds;
  };
  const StereoFeatures late = seen(velocity, kPeriod, 0.15);
  EXPECT_GT(measure(late, velocity), 0.0);
  EXPECT_GT(measure(seen(Vector6d::Zero(), kPeriod, 0.15), Vector6d::Zero()), 0.0) << "a camera that stands";
  EXPECT_GT(measure(seen(velocity, 0.0, 0.5), 0.1 * velocityAt(2.0)), -2.9) << "rows that neither explains";
  EXPECT_LT(measure(seen(velocity, 0.0, 0.15), velocity), 0.0);
  EXPECT_GT(measure(late, velocity), 0.0);
  double log_odds = 0.0;
  for (int pair = 0; pair < 20; ++pair) log_odds = measure(seen(Vector6d::Zero(), kPeriod, 0.15), Vector6d::Zero());
  EXPECT_LT(log_odds, logOdds(0.05)) << "a camera that stands for long";
}

TEST(RightCameraDelay, LeftImagesThatShiftWhileTheCameraStandsAreNoPartnerOfAnotherPair) {
  // The motion follows the left image, and dv contains its error with the other sign.
  RightCameraDelay right_delay;
  std::mt19937 random(1);
  std::normal_distribution<double> shift(0.0, 0.2), noise(0.0, 0.05), place(0.0, 1.0);
  for (int pair = 0; pair < 50; ++pair) {
    const double turn = shift(random);
    std::vector<RowMotion> rows;
    for (int i = 0; i < 200; ++i) {
      const double moved = turn * place(random);
      rows.push_back({moved / kPeriod, noise(random) - moved, i % RowDelay::kParts});
    }
    right_delay.updateOtherPair(rows, kPeriod, kRowError);
    EXPECT_LT(right_delay.otherPair(kPeriod).log_odds, logOdds(0.05)) << pair;
  }
}

TEST(RightCameraDelay, PartsOfTheImageAreTheWitnessesHoweverManyCornersTheyHave) {
  // Rows follow a right image that is the next pair's, in so many parts.
  const auto evidence = [](int parts, int corners) {
    RightCameraDelay right_delay;
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::vector<RowMotion> rows;
    for (int i = 0; i < corners; ++i) {
      const double velocity = 3.0 * (i % parts % 2);  // px/s
      rows.push_back({velocity, kPeriod * velocity + 0.1 * normal(random), i % parts});
    }
    right_delay.updateOtherPair(rows, kPeriod, kRowError);
    return right_delay.otherPair(kPeriod).log_odds - kUnsuspected;
  };
  EXPECT_NEAR(evidence(2, 2000) / evidence(2, 200), 1.0, 0.2);
  EXPECT_NEAR(evidence(24, 2000) / evidence(2, 2000), 23.0, 1.0);
}

TEST(RightCameraDelay, DoubtedPairsTeachNothing) {
  RightCameraDelay right_delay = watched(0.0, 60);
  const double known = right_delay.estimate()->value;
  for (int k = 60; k < 120; ++k) learn(right_delay, k, 0.01, false);
  EXPECT_EQ(right_delay.estimate()->value, known);
}

}  // namespace sdvo::test_right_camera_delay
