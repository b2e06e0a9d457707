#include <gtest/gtest.h>

#include "../../src/belief/motion_search.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_motion_search {

/// What a camera sees that stands still or moves along x, of a world that stands and of a swarm that moves along x,
/// too.
class Street {
 public:
  StereoFeatures see(double camera_x, double swarm_x, std::int64_t stamp, bool world_visible = true,
                     bool swarm_visible = true) const {
    StereoFeatures features = synthetic::noFeatures(synthetic::camera(), stamp);
    if (world_visible) add(features, world_, camera_x);
    if (swarm_visible) add(features, swarm_, camera_x - swarm_x);
    return features;
  }

  /// A nearer world hides what is behind it.
  static void add(StereoFeatures& features, const synthetic::World& world, double x, double max_depth = 40.0) {
    synthetic::Sighting sighting;
    sighting.max_depth = max_depth;
    const Eigen::Isometry3d T_camera_world(Eigen::Translation3d(-x, 0.0, 0.0));
    const StereoFeatures seen =
        synthetic::observe(world, synthetic::camera(), T_camera_world, features.stamp, sighting);
    if (seen.count() == 0) return;
    const auto [left, right] = std::minmax_element(seen.u.begin(), seen.u.end());
    const auto [top, bottom] = std::minmax_element(seen.v.begin(), seen.v.end());
    const float nearest = *std::min_element(seen.disparity.begin(), seen.disparity.end());
    std::vector<int> visible;
    for (int i = 0; i < features.count(); ++i)
      if (features.disparity[i] > nearest || features.u[i] < *left || features.u[i] > *right || features.v[i] < *top ||
          features.v[i] > *bottom)
        visible.push_back(i);
    features = features.select(visible);
    synthetic::addAll(features, seen);
  }

 private:
  synthetic::World world_ = synthetic::randomWorld(21, 250, {-10.0, -4.0, 6.0}, {10.0, 3.0, 12.0});
  synthetic::World swarm_ = synthetic::randomWorld(22, 300, {-2.0, -1.5, 3.0}, {2.0, 1.5, 5.0});
};

void addNoise(StereoFeatures& features, std::normal_distribution<float>& noise, std::mt19937& random) {
  for (auto* numbers : {&features.u, &features.v, &features.disparity})
    for (float& number : *numbers) number += noise(random);
}

/// Points 35 to 50 m away, which hardly move with the camera.
synthetic::World farWorld(int count) {
  return synthetic::randomWorld(23, count, {-25.0, -8.0, 35.0}, {25.0, 6.0, 50.0});
}

/// A board 4 m ahead.
synthetic::World boardFrom(unsigned seed, double left, double right = 2.0, int points = 300) {
  return synthetic::randomWorld(seed, points, {left, -1.5, 3.9}, {right, 1.5, 4.1});
}

constexpr std::int64_t kPeriod = 100000000;  // ns

/// A map that is extended with the motions that the search finds.
class MotionSearchTest : public ::testing::Test {
 protected:
  /// The pair's motion since the map's newest pair; `expected` is how far along x the camera is expected to go.
  MotionHypothesis find(const StereoFeatures& features, std::optional<double> expected, bool is_doubted = false) const {
    return search_.find(sceneOf(features, expected, expected, is_doubted), kLargestDoubt);
  }

  /// Where no prior tells that the camera cannot have been that fast.
  MotionHypothesis findAround(const StereoFeatures& features, double expected) const {
    return search_.find(sceneOf(features, expected, std::nullopt, false), kLargestDoubt);
  }

  MotionScene sceneOf(const StereoFeatures& features, std::optional<double> expected, std::optional<double> prior,
                      bool is_doubted) const {
    MotionScene scene{map_, calibration_, features};
    scene.all_compete = scene.searches_wide = is_doubted;
    scene.noise = noise_of_rig_;
    if (expected) scene.T_current_reference = Eigen::Isometry3d(Eigen::Translation3d(-*expected, 0.0, 0.0));
    if (prior)
      scene.prior.push_back(MotionPrior({}).around(Eigen::Isometry3d(Eigen::Translation3d(*prior, 0.0, 0.0)), 0.1));
    return scene;
  }

  void begin(const StereoFeatures& features) {
    map_.insert(features, ++pairs_, Eigen::Isometry3d::Identity(), {}, calibration_);
  }

  void extend(const StereoFeatures& features, const MotionHypothesis& found) {
    map_.insert(features, ++pairs_, found.motion.T_current_reference * map_.newestPose(), found.sightings,
                calibration_);
  }

  /// The first `count` pairs of a camera that stands.
  void start(int count, const std::function<StereoFeatures()>& see) {
    begin(see());
    while (pairs_ < count) stand(see());
  }
  /// Of the standing world.
  void start(int count) {
    start(count, [this] { return street_.see(0.0, 0.0, stamp(), true, false); });
  }
  void stand(const StereoFeatures& features) { extend(features, find(features, 0.0)); }

  StereoFeatures nothing() const { return synthetic::noFeatures(synthetic::camera(), stamp()); }
  std::int64_t stamp() const { return (pairs_ + 1) * kPeriod; }
  static double moved(const MotionHypothesis& found) { return -found.motion.T_current_reference.translation().x(); }

  Street street_;
  LocalMap map_{LocalMapOptions()};
  RigCalibration calibration_;
  Noise noise_of_rig_{NoiseOptions()};
  MotionSearch search_{MotionEstimatorOptions()};
  const double kLargestDoubt = logOdds(0.05);
  int pairs_ = 0;
};

TEST_F(MotionSearchTest, TakesASoundMotionThatWasExpected) {
  start(2);
  const MotionHypothesis found = find(street_.see(0.1, 0.0, stamp(), true, false), 0.1);
  ASSERT_TRUE(found.motion.success) << found.motion.reason;
  EXPECT_EQ(found.probability, 1.0);
  EXPECT_NEAR(moved(found), 0.1, 1e-3);
  EXPECT_LT(found.innovation, 1.0);
  EXPECT_EQ(found.agreement.inliers, static_cast<int>(found.motion.inliers.size()));
  EXPECT_EQ(found.sightings.size(), found.motion.inliers.size());
}

TEST_F(MotionSearchTest, AWrongExpectationIsOneHypothesisAmongOthers) {
  start(2);
  // Points 5 m away were expected 120 px beside where they are, beyond the gate.
  const MotionHypothesis found = find(street_.see(0.1, 0.0, stamp(), true, false), 1.6);
  EXPECT_NEAR(moved(found), 0.1, 1e-3);
  EXPECT_GT(found.agreement.inliers, 100);
  EXPECT_EQ(found.sightings.size(), found.motion.inliers.size());
}

TEST_F(MotionSearchTest, WhatIsTornFromARowOnIsDoubtfulHoweverMuchOfTheViewItIs) {
  start(2);
  // The lower two thirds are where the camera would see them 0.1 m further on, which the prior allows.
  const StereoFeatures sound = street_.see(0.1, 0.0, stamp(), true, false);
  std::vector<float> rows = sound.v;
  std::nth_element(rows.begin(), rows.begin() + rows.size() / 3, rows.end());
  const float row = rows[rows.size() / 3];
  const auto part = [&](const StereoFeatures& features, bool above) {
    std::vector<int> indices;
    for (int i = 0; i < features.count(); ++i)
      if ((features.v[i] < row) == above) indices.push_back(i);
    return features.select(indices);
  };
  StereoFeatures torn = part(sound, true);
  synthetic::addAll(torn, part(street_.see(0.2, 0.0, stamp(), true, false), false));
  const MotionHypothesis found = find(torn, 0.15);
  ASSERT_TRUE(found.rival);
  EXPECT_TRUE(found.rival->is_torn);
  EXPECT_LT(found.probability, 0.7);
  EXPECT_EQ(find(sound, 0.15).probability, 1.0);
}

TEST_F(MotionSearchTest, AnExpectationThatIsALittleWrongIsLookedAroundFurther) {
  start(2);
  // Points 6 to 12 m away were expected 27 to 53 px beside where they are: beyond the gate, not three times as far.
  const MotionHypothesis found = findAround(street_.see(0.1, 0.0, stamp(), true, false), 0.9);
  ASSERT_TRUE(found.motion.success) << found.motion.reason;
  EXPECT_EQ(found.probability, 1.0);
  EXPECT_NEAR(moved(found), 0.1, 1e-3);
  EXPECT_GT(found.agreement.inliers, 100);
}

TEST_F(MotionSearchTest, WhatWasFoundNearTheExpectationMustNotLeaveThatOut) {
  // Points far away are where they were expected, those nearby are not, and tell the step.
  const synthetic::World far = synthetic::randomWorld(25, 300, {-25.0, -8.0, 35.0}, {25.0, 6.0, 50.0});
  const synthetic::World near = synthetic::randomWorld(26, 120, {-4.0, -2.0, 5.0}, {4.0, 2.0, 6.0});
  const auto see = [&](double x) {
    StereoFeatures features = nothing();
    for (const synthetic::World* world : {&far, &near}) Street::add(features, *world, x, 60.0);
    return features;
  };
  start(2, [&] { return see(0.0); });
  const MotionHypothesis found = findAround(see(0.1), 0.6);
  EXPECT_NEAR(moved(found), 0.1, 1e-3);
  const auto isNear = [&](int i) { return found.correspondences[static_cast<std::size_t>(i)].point.z() < 10.0; };
  const std::vector<int>& inliers = found.motion.inliers;
  EXPECT_GT(std::count_if(inliers.begin(), inliers.end(), isNear), 50);
}

TEST_F(MotionSearchTest, WhatStoodStillSoFarOutvotesAMajority) {
  start(5);
  stand(street_.see(0.0, 0.0, stamp()));
  const MotionHypothesis found = find(street_.see(0.0, 0.4, stamp()), 0.0, true);
  ASSERT_TRUE(found.motion.success) << found.motion.reason;
  EXPECT_NEAR(moved(found), 0.0, 1e-3);
  ASSERT_TRUE(found.rival);
  EXPECT_NEAR(found.rival->T_current_reference.translation().x(), 0.4, 1e-3) << "as if the swarm stood";
  EXPECT_LT(found.rival->probability, 0.05) << "what goes on as before is confirmed by lasting points";
  EXPECT_GT(found.rivals_moment(0, 0), 0.9 * found.rival->probability * 0.16);
}

/// A board arrives before what stood still so far, and moves by less than corners may err.
class SlowBoard : public MotionSearchTest {
 protected:
  StereoFeatures see(std::optional<double> board_x) {
    StereoFeatures features = nothing();
    Street::add(features, still_, 0.0);
    if (board_x) Street::add(features, board_, -*board_x);
    addNoise(features, noise_, random_);
    return features;
  }

  void arrive() {
    begin(see({}));
    while (pairs_ < 5) extend(see({}), find(see({}), 0.0));
    extend(see(0.0), find(see(0.0), 0.0));
  }

  std::normal_distribution<float> noise_{0.f, 1e-3f};

 private:
  std::mt19937 random_{30};
  synthetic::World still_ = synthetic::randomWorld(27, 600, {-10.0, -4.0, 6.0}, {10.0, 3.0, 12.0});
  synthetic::World board_ = boardFrom(28, -2.0, 2.0, 500);
};

TEST_F(SlowBoard, IsLeftAside) {
  arrive();
  // The board moves by 0.7 px: inliers of any motion are all there is.
  const MotionHypothesis found = find(see(0.007), 0.0);
  EXPECT_NEAR(moved(found), 0.0, 1e-4);
  EXPECT_EQ(found.agreement.inliers, static_cast<int>(found.motion.inliers.size()));
  EXPECT_EQ(found.agreement.inliers, found.agreement.lasting_inliers) << "the board is no longer among them";
  EXPECT_LT(found.agreement.matches, 1.1 * found.agreement.inliers) << "nor does it count against them";
  EXPECT_EQ(found.sightings.size(), found.motion.inliers.size());
  EXPECT_FALSE(found.rival) << "millimetres are within tolerance";
  EXPECT_GT(std::sqrt(found.rivals_moment(0, 0)), 0.001) << "the covariance has to hold what all inliers together say";
}

TEST_F(SlowBoard, IsToldByWhatTheRigIsKnownToErr) {
  noise_ = std::normal_distribution<float>(0.f, 0.1f);
  arrive();
  const StereoFeatures features = see(0.008);
  for (int pair = 0; pair < 100; ++pair) noise_of_rig_.learnShared(250.0);
  const MotionHypothesis alike = find(features, 0.0);
  EXPECT_GT(std::abs(moved(alike)), 4e-3) << "a rig whose neighbours err alike";
  EXPECT_GT(alike.lasting_square.value_or(0.0), noiseGate(6));
  for (int pair = 0; pair < 100; ++pair) noise_of_rig_.learnShared(6.0);
  EXPECT_NEAR(moved(find(features, 0.0)), 0.0, 2e-3) << "a rig whose points err by themselves";
}

TEST_F(MotionSearchTest, AnErrorThatLastingPointsShareIsNoMover) {
  // Nothing moves. All lasting points are off by as much as the camera would be 7 mm further, half a pixel at most; new
  // ones are not.
  const synthetic::World still = synthetic::randomWorld(27, 700, {-10.0, -4.0, 6.0}, {10.0, 3.0, 12.0});
  const synthetic::World arrived = boardFrom(28, -2.0);
  std::mt19937 random(29);
  std::normal_distribution<float> noise(0.f, 0.1f);
  const auto see = [&](double error, bool all) {
    StereoFeatures features = nothing();
    Street::add(features, still, error);
    if (all) Street::add(features, arrived, 0.0);
    addNoise(features, noise, random);
    return features;
  };
  begin(see(0.0, false));
  while (pairs_ < 5) extend(see(0.0, false), find(see(0.0, false), 0.0));
  extend(see(0.0, true), find(see(0.0, true), 0.0));
  const MotionHypothesis found = find(see(0.007, true), 0.0);
  ASSERT_TRUE(found.motion.success) << found.motion.reason;
  EXPECT_FALSE(found.rival);
}

TEST_F(MotionSearchTest, FarPointsThatAgreeWithAnyStepAreNoMajority) {
  // A board 4 m ahead steps aside. A step and a little turn of the camera explain that and nearly what is far away.
  const synthetic::World far = farWorld(150), board = boardFrom(24, -2.0);
  const auto see = [&](std::optional<double> board_x) {
    StereoFeatures features = nothing();
    Street::add(features, far, 0.0, 60.0);
    if (board_x) Street::add(features, board, -*board_x, 60.0);
    return features;
  };
  start(5, [&] { return see({}); });
  stand(see(0.0));
  const MotionHypothesis found = find(see(0.1), 0.0);
  EXPECT_NEAR(moved(found), 0.0, 0.01);
  EXPECT_TRUE(found.rival);
}

/// The board has been there as long as the rest, and what goes on as before decides.
TEST_F(MotionSearchTest, MotionsThatOnlyFarPointsConfuseAreTwo) {
  const synthetic::World far = farWorld(100);
  const synthetic::World near = synthetic::randomWorld(25, 60, {-2.0, -1.5, 4.0}, {0.0, 1.5, 6.0});
  for (const bool has_near : {true, false}) {
    map_ = LocalMap{LocalMapOptions()};
    pairs_ = 0;
    const synthetic::World board = boardFrom(24, has_near ? 0.0 : -2.0);
    const auto see = [&](double board_x) {
      StereoFeatures features = nothing();
      Street::add(features, far, 0.0, 60.0);
      if (has_near) Street::add(features, near, 0.0);
      Street::add(features, board, -board_x);
      return features;
    };
    begin(see(0.0));
    // Without anything near that stands a step and a turn explain both the board and what is far away.
    EXPECT_TRUE(has_near || moved(findAround(see(0.15), 0.0)) < -0.1) << "most agree with the compromise";
    const MotionHypothesis found = find(see(0.15), 0.0, true);
    EXPECT_NEAR(moved(found), 0.0, has_near ? 0.01 : 0.02);
    EXPECT_LT(found.probability, 0.95) << "it may be the board that stands";
  }
}

TEST_F(MotionSearchTest, WithoutLastingPointsTheOneThatGoesOnAsBeforeWins) {
  begin(street_.see(0.0, 0.0, stamp()));
  const StereoFeatures features = street_.see(0.0, 0.4, stamp());
  EXPECT_NEAR(moved(find(features, 0.0, true)), 0.0, 1e-3) << "of the world";
  EXPECT_NEAR(moved(find(features, -0.4, true)), -0.4, 1e-3) << "of the swarm";
}

/// What is left of the world beside a board that is fixed to the camera and covers most of the view.
class CoveredView : public MotionSearchTest {
 protected:
  StereoFeatures see(double camera_x, bool world_visible = true) const {
    StereoFeatures features = nothing();
    if (world_visible) Street::add(features, world_, camera_x);
    Street::add(features, board_, 0.0);
    return features;
  }

  /// Where no prediction tells the copies of the board in the map from the board.
  MotionHypothesis findUnguided(const StereoFeatures& features) const {
    return search_.find(sceneOf(features, std::nullopt, kStep, true), kLargestDoubt);
  }

  static constexpr double kStep = 1.2;  // m between pairs: no camera stops from there

 private:
  synthetic::World world_ = synthetic::randomWorld(26, 120, {-2.0, -2.0, 8.0}, {14.0, 2.0, 12.0});
  synthetic::World board_ = boardFrom(27, -2.0, 1.0, 400);
};

TEST_F(CoveredView, WhatNoCameraDoesIsNotTheCamerasHoweverManyAgree) {
  begin(see(0.0));
  for (const double x : {kStep, 2.0 * kStep, 3.0 * kStep}) {
    // With each pair the board has left one more copy of itself in the map.
    const StereoFeatures features = see(x);
    const MotionHypothesis found = find(features, kStep, x > kStep);
    ASSERT_TRUE(found.motion.success) << found.motion.reason;
    EXPECT_NEAR(moved(found), kStep, 0.02) << x;
    EXPECT_LT(found.agreement.inliers, 40);
    EXPECT_EQ(found.rival.has_value(), x > kStep) << "the board is not looked for until something is in doubt";
    EXPECT_NEAR(moved(findUnguided(features)), kStep, 0.02) << x;
    extend(features, found);
  }
}

TEST_F(CoveredView, WhereNothingElseIsSeenTheMotionIsLikelyNotTheCameras) {
  begin(see(0.0, false));
  const StereoFeatures features = see(0.0, false);
  EXPECT_GT(logOddsWrong(find(features, kStep, true)), 0.0);
  EXPECT_LT(logOddsWrong(find(features, 0.0, true)), kLargestDoubt);
}

TEST_F(MotionSearchTest, FailsWithAReason) {
  start(2);
  const MotionHypothesis found = find(nothing(), 0.0);
  EXPECT_FALSE(found.motion.success);
  EXPECT_TRUE(contains(found.motion.reason, "only 0 matches")) << found.motion.reason;
}

}  // namespace sdvo::test_motion_search
