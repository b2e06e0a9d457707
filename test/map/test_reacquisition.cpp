#include <gtest/gtest.h>

#include "../../src/common/statistics.hpp"
#include "../../src/map/reacquisition.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_reacquisition {

constexpr std::int64_t kPeriod = 50'000'000;  // ns between pairs
constexpr int kSeen = 10;                     // pairs before an outage

TEST(BinomialTail, AddsUpTheProbabilities) {
  EXPECT_NEAR(binomialTail(3, 0, 0.3), 1.0, 1e-12);
  EXPECT_NEAR(binomialTail(3, 2, 0.5), 0.5, 1e-12);  // 3 and 1 of 8
  EXPECT_NEAR(binomialTail(4, 4, 0.25), 1.0 / 256.0, 1e-12);
  EXPECT_EQ(binomialTail(4, 5, 0.25), 0.0);
}

/// Points evenly over an image, of which those in its left `share` are found with a probability.
std::vector<ExpectedPoint> spread(double share, double probability) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<ExpectedPoint> points;
  for (int i = 0; i < 800; ++i) {
    const Eigen::Vector2d pixel(640.0 * uniform(random), 480.0 * uniform(random));
    points.push_back({pixel, pixel.x() < share * 640.0 && uniform(random) < probability});
  }
  return points;
}

TEST(SamePlace, FewPointsWillDoThatAreSpread) {
  EXPECT_LT(chanceOfAnotherPlace(spread(1.0, 0.1)), 0.001);
  EXPECT_LT(chanceOfAnotherPlace(spread(1.0, 0.8)), 0.001);
}

TEST(SamePlace, ManyPointsWillNotInAPartOfTheView) {
  for (const double share : {0.1, 0.2, 0.33}) EXPECT_GT(chanceOfAnotherPlace(spread(share, 0.9)), 0.05) << share;
}

TEST(SamePlace, NothingIsNoPlace) {
  EXPECT_EQ(chanceOfAnotherPlace({}), 1.0);
  EXPECT_EQ(chanceOfAnotherPlace(spread(0.0, 1.0)), 1.0);
}

/// A drive to and fro in a room; it is blind for a while, and then it sees another world, or this one.
class Outage : public ::testing::Test {
 protected:
  static synthetic::World room(unsigned seed) {
    return synthetic::randomWorld(seed, 1500, {-6.0, -2.0, 3.0}, {6.0, 2.0, 9.0});
  }

  static Eigen::Isometry3d poseAt(int i) {
    return expSE3((Vector6d() << 0.03 * i, 0.01 * i, 0.02 * i, 0.0, 0.005 * i, 0.0).finished());
  }

  /// Pair i of a world from a pose.
  void see(const synthetic::World& world, int i, const Eigen::Isometry3d& T_origin_camera,
           const std::optional<MotionGuess>& guess = {}) {
    synthetic::Sighting sighting;
    sighting.noise = 0.2;
    sighting.flipped = 0.03;
    sighting.strangers = 40;
    sighting.seed = 300 + static_cast<unsigned>(i);
    result_ = odometry_->update(
        synthetic::observe(world, synthetic::camera(), T_origin_camera.inverse(), i * kPeriod, sighting), guess);
  }

  /// From where the drive has the camera.
  void see(const synthetic::World& world, int i, const std::optional<MotionGuess>& guess = {}) {
    see(world, i, poseAt(i), guess);
  }

  void seeNothing(int i, const std::optional<MotionGuess>& guess = {}) {
    result_ = odometry_->update(synthetic::noFeatures(synthetic::camera(), i * kPeriod), guess);
  }

  /// A new odometry sees the first pairs; the number of the next one.
  int drive(const VisualOdometryOptions& options = {}) {
    odometry_.emplace(options);
    for (int i = 0; i < kSeen; ++i) see(room_, i);
    EXPECT_EQ(result_.state, TrackingState::kTracking) << result_.reason;
    return kSeen;
  }

  /// Blind pairs after these; the number of the next one.
  int blind(int pairs) {
    for (int i = kSeen; i < kSeen + pairs; ++i) seeNothing(i);
    EXPECT_EQ(result_.state, TrackingState::kLost);
    EXPECT_FALSE(result_.has_pose);
    return kSeen + pairs;
  }

  /// The pose's error, and its square in units of its covariance.
  Vector6d error(const Eigen::Isometry3d& truth) const { return logSE3(truth.inverse() * result_.T_origin_camera); }
  double normalisedError(const Eigen::Isometry3d& truth) const {
    return mahalanobisSquare(error(truth), result_.pose_covariance);
  }
  double positionVariance() const { return result_.pose_covariance.topLeftCorner<3, 3>().trace(); }

  void expectState(TrackingState state, int epoch) const {
    EXPECT_EQ(result_.state, state) << result_.reason;
    EXPECT_EQ(result_.epoch, epoch) << result_.reason;
  }

  void expectFoundAt(const Eigen::Isometry3d& T_origin_camera) const {
    expectState(TrackingState::kTracking, 0);
    EXPECT_TRUE(contains(result_.reason, "re-acquired by " + std::to_string(result_.inliers) + " points"))
        << result_.reason;
    EXPECT_LT(error(T_origin_camera).head<3>().norm(), 0.01);
    EXPECT_LT(normalisedError(T_origin_camera), 25.0);
    EXPECT_LT(positionVariance(), 0.1) << "that of a restart is larger by far";
  }

  /// The old map is kept until the next pair, of another world, is measured against this one.
  void expectStartedAgainBy(const synthetic::World& world, int next, const Eigen::Isometry3d& T_origin_camera) {
    expectState(TrackingState::kLost, 0);
    EXPECT_FALSE(result_.has_pose);
    see(world, next, T_origin_camera);
    expectState(TrackingState::kDegraded, 1);
    EXPECT_TRUE(result_.has_pose) << result_.reason;
    EXPECT_TRUE(contains(result_.reason, "started again")) << result_.reason;
  }

  synthetic::World room_ = room(1);
  std::optional<VisualOdometry> odometry_;
  OdometryResult result_;
};

TEST_F(Outage, TheSameEpochGoesOnWhereTheCameraHasMovedTo) {
  for (const int pairs : {3, 5, 20}) {
    drive();
    const OdometryResult before = result_;
    const int i = blind(pairs);
    see(room_, i);
    expectFoundAt(poseAt(i));
    EXPECT_TRUE(result_.has_motion);
    // It begins at the last pose, which was predicted for the first blind pair.
    EXPECT_NEAR(result_.dt, 0.05 * pairs, 1e-9);
    EXPECT_GT(result_.distance, before.distance);
    for (int k = 1; k < 5; ++k) {
      see(room_, i + k);
      expectState(TrackingState::kTracking, 0);
      EXPECT_FALSE(contains(result_.reason, "re-acquired"));
      EXPECT_NEAR(result_.dt, 0.05, 1e-9);
      EXPECT_LT(error(poseAt(i + k)).head<3>().norm(), 0.01);
    }
  }
}

TEST_F(Outage, ACameraThatStoodOrStillSeesAThirdOfTheViewLosesNothing) {
  const Eigen::Isometry3d turned = poseAt(kSeen + 10) * Eigen::AngleAxisd(0.75, Eigen::Vector3d::UnitY());
  for (const auto& [pairs, pose] : {std::pair(30, poseAt(kSeen - 1)), std::pair(10, turned)}) {
    drive();
    see(room_, blind(pairs), pose);
    expectFoundAt(pose);
  }
}

TEST_F(Outage, ADimPairIsWaitedOut) {
  drive();
  const int i = blind(3);
  const StereoFeatures lit = synthetic::observe(room_, synthetic::camera(), poseAt(i).inverse(), i * kPeriod);
  EXPECT_EQ(odometry_->update(lit.select({0, 1, 2, 3, 4, 5, 6, 7})).state, TrackingState::kLost);
  see(room_, i + 1);
  expectFoundAt(poseAt(i + 1));
}

TEST_F(Outage, AStreamThatWasBrokenGoesOnToo) {
  const int i = drive() + 3;
  odometry_->breakStream();
  see(room_, i);
  expectFoundAt(poseAt(i));
}

TEST_F(Outage, OddPairsBetweenItAndTheFirstGoodOneAreWaitedOut) {
  for (const int odd : {1, 4}) {
    drive();
    int i = blind(3);
    for (const int end = i + odd; i < end; ++i) {
      see(room(20 + static_cast<unsigned>(i)), i);
      expectState(TrackingState::kLost, 0);
    }
    see(room_, i);
    expectFoundAt(poseAt(i));
  }
}

/// A corridor whose segments are equal; the camera goes along it at 3 m/s.
TEST_F(Outage, EqualSegmentsAreAMixture) {
  constexpr double kSegment = 3.0;  // m
  const auto alongAt = [](int i) -> Eigen::Isometry3d {
    return Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 0.15 * i));
  };
  const synthetic::World segment = synthetic::randomWorld(3, 150, {-2.0, -1.5, 0.0}, {2.0, 1.5, kSegment});
  // The points at its beginning are behind the camera after the outage.
  room_ = synthetic::randomWorld(4, 400, {-2.0, -1.5, 3.0}, {2.0, 1.5, 4.5});
  for (int k = 0; k < 12; ++k)
    for (std::size_t p = 0; p < segment.points.size(); ++p) {
      room_.points.push_back(segment.points[p] + Eigen::Vector3d(0.0, 0.0, k * kSegment));
      room_.rows.push_back(segment.rows[p]);
    }
  odometry_.emplace(VisualOdometryOptions());
  for (int i = 0; i < kSeen; ++i) see(room_, i, alongAt(i));
  expectState(TrackingState::kTracking, 0);
  const int i = blind(40);  // 2 s, two segments
  for (int k = 0; k < 5; ++k) {
    see(room_, i + k, alongAt(i + k));
    if (!result_.has_pose) continue;
    EXPECT_LT(normalisedError(alongAt(i + k)), 25.0) << k << ": " << result_.reason;
    EXPECT_TRUE(k > 0 || contains(result_.reason, "other places of the map look alike")) << result_.reason;
  }
  EXPECT_TRUE(result_.has_pose) << result_.reason;
}

TEST_F(Outage, AnotherPlaceIsANewStart) {
  std::vector<synthetic::World> others(1, room_);
  // Mirrored, with the descriptors of the original, which a real one does not have.
  for (Eigen::Vector3d& point : others[0].points) point.x() = -point.x();
  for (unsigned seed = 2; seed < 12; ++seed) others.push_back(room(seed));
  for (const synthetic::World& other : others) {
    drive();
    const int i = blind(5);
    see(other, i);
    expectStartedAgainBy(other, i + 1, poseAt(i + 1));
  }
}

TEST_F(Outage, WhatStandsInBothPlacesIsNoPlace) {
  // The left third of the view, wherever the camera goes, and all else is new.
  drive();
  const int i = blind(5);
  synthetic::World other = room(2);
  for (std::size_t p = 0; p < room_.points.size(); ++p) {
    const Eigen::Vector3d pixel = synthetic::camera().project(poseAt(i).inverse() * room_.points[p]);
    const Eigen::Vector3d elsewhere = synthetic::camera().project(poseAt(i).inverse() * other.points[p]);
    const double third = synthetic::camera().width / 3.0;
    if (elsewhere.x() < third) other.points[p].y() = 100.0;  // out of view
    if (pixel.x() >= third) continue;
    other.points.push_back(room_.points[p]);
    other.rows.push_back(room_.rows[p]);
  }
  see(other, i);
  expectStartedAgainBy(other, i + 1, poseAt(i + 1));
}

TEST_F(Outage, WrongPartnersAreWaitedOutAsBlindPairsAre) {
  for (const int refused : {2, 5}) {
    const int next = drive() + refused;
    for (int i = kSeen; i < next; ++i) {
      StereoFeatures swapped = synthetic::noFeatures(synthetic::camera(), i * kPeriod);
      swapped.report.refused = true;
      result_ = odometry_->update(swapped);
    }
    expectState(TrackingState::kLost, 0);
    see(room_, next);
    expectFoundAt(poseAt(next));
  }
}

TEST_F(Outage, APlaceTooFarForTheTimeIsANewStart) {
  VisualOdometryOptions options;
  options.tracking.max_speed = 2.0;  // 0.9 m in 6 pairs
  drive(options);
  const int i = blind(5);
  const Eigen::Isometry3d far = Eigen::Translation3d(2.0, 0.0, 0.0) * poseAt(kSeen);
  see(room_, i, far);
  expectStartedAgainBy(room_, i + 1, far);
}

/// What wheels tell: the true motion since the pair before, too long by a twentieth.
class GuessedOutage : public Outage {
 protected:
  static MotionGuess wheelsAt(int i) {
    return {expSE3(1.05 * logSE3(poseAt(i - 1).inverse() * poseAt(i))), false, 0.1};
  }
};

TEST_F(GuessedOutage, ThePoseGoesOnByTheGuessWhileItIsDark) {
  const int end = drive() + 20;
  for (int i = kSeen; i < end; ++i) {
    seeNothing(i, wheelsAt(i));
    expectState(TrackingState::kDegraded, 0);
    EXPECT_LT(normalisedError(poseAt(i)), 12.6) << i;
  }
  EXPECT_GT(positionVariance(), 0.001) << "5 % of 0.75 m";
  // The map corrects it.
  see(room_, end, wheelsAt(end));
  EXPECT_EQ(result_.epoch, 0);
  EXPECT_LT(error(poseAt(end)).head<3>().norm(), 0.01);
  EXPECT_LT(positionVariance(), 0.001);
}

/// What a gyro tells: the rotation, too large by a twentieth.
MotionGuess gyro(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Vector6d motion = 1.05 * logSE3(from.inverse() * to);
  motion.head<3>().setConstant(100.0);  // nothing is to look at it
  return {expSE3(motion), true, 0.1};
}

/// The drive, turning much faster from the outage on.
Eigen::Isometry3d turningAt(int i) {
  return expSE3(
      (Vector6d() << 0.03 * i, 0.01 * i, 0.02 * i, 0.0, 0.005 * i + 0.05 * std::max(i - kSeen, 0), 0.0).finished());
}

TEST_F(GuessedOutage, AGyroCarriesThePoseForAsLongAsTheTranslationIsPredicted) {
  const int next = drive() + 40;
  for (int i = kSeen; i < next; ++i) {
    seeNothing(i, gyro(turningAt(i - 1), turningAt(i)));
    const bool is_short = (i - (kSeen - 1)) * kPeriod <= 1'000'000'000;  // tracking/max_gap
    expectState(is_short ? TrackingState::kDegraded : TrackingState::kLost, 0);
    EXPECT_TRUE(!is_short || normalisedError(turningAt(i)) < 12.6) << i;
  }
  // The room is another one; the turn is known.
  see(room(2), next, turningAt(next), gyro(turningAt(next - 1), turningAt(next)));
  expectState(TrackingState::kDegraded, 0);  // until a pair is measured there
  EXPECT_LT(error(turningAt(next)).tail<3>().norm(), 0.2) << "of a turn by 2 rad";
  EXPECT_LT((result_.pose_covariance.bottomRightCorner<3, 3>().trace()), 0.2);
  EXPECT_LT(normalisedError(turningAt(next)), 12.6);
}

TEST_F(GuessedOutage, AfterTheLongestTimeTheGuessCarriesThePoseToTheNextStart) {
  VisualOdometryOptions options;
  options.tracking.max_guessed = 0.5;
  const int next = drive(options) + 20;
  for (int i = kSeen; i < next; ++i) seeNothing(i, wheelsAt(i));
  expectState(TrackingState::kLost, 0);
  see(room(2), next, wheelsAt(next));
  expectState(TrackingState::kDegraded, 0);
  EXPECT_LT(error(poseAt(next)).head<3>().norm(), 0.1);
  EXPECT_LT(normalisedError(poseAt(next)), 12.6);
  for (int i = next + 1; i < next + 4; ++i) {
    see(room(2), i, wheelsAt(i));
    EXPECT_EQ(result_.state, TrackingState::kTracking) << result_.reason;
    EXPECT_LT(error(poseAt(i)).head<3>().norm(), 0.1);
  }
}

TEST_F(GuessedOutage, AGuessThatEndsCarriesNoPose) {
  const int next = drive() + 5;
  seeNothing(kSeen, wheelsAt(kSeen));
  for (int i = kSeen + 1; i < next; ++i) seeNothing(i);
  expectState(TrackingState::kLost, 0);
  see(room(2), next, wheelsAt(next));
  expectStartedAgainBy(room(2), next + 1, poseAt(next + 1));
}

TEST_F(Outage, APoseFromElsewhereIsANewEpochOfTheSameMap) {
  drive();
  const Matrix6d covariance = 0.01 * Matrix6d::Identity();
  odometry_->setPoseCovariance(covariance);
  EXPECT_TRUE(odometry_->lastPose().isApprox(result_.T_origin_camera));
  see(room_, kSeen);
  expectState(TrackingState::kTracking, 1);
  EXPECT_TRUE(result_.has_motion);
  EXPECT_LT(error(poseAt(kSeen)).head<3>().norm(), 0.01);
  EXPECT_NEAR(result_.pose_covariance.trace(), covariance.trace(), 0.01 * covariance.trace());
}

TEST_F(Outage, APoseFromElsewhereEndsTheSearchOfALostCamera) {
  drive();
  const int i = blind(5);
  const Eigen::Isometry3d last = odometry_->lastPose();
  odometry_->setPoseCovariance(0.01 * Matrix6d::Identity());
  see(room_, i);
  expectState(TrackingState::kTracking, 1);
  EXPECT_TRUE(result_.T_origin_camera.isApprox(last));
  EXPECT_NEAR(result_.pose_covariance.trace(), 0.06, 1e-9);
}

}  // namespace sdvo::test_reacquisition
