#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>

#include "../../src/odometry/outage.hpp"
#include "../../src/rig/right_rotation.hpp"
#include "../../src/rig/row_readout.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "stereo_descriptor_vo/odometry/visual_odometry.hpp"

namespace sdvo::test_visual_odometry {

constexpr std::int64_t kPeriod = 100000000;  // ns between pairs
constexpr double kStep = 0.8;                // m between pairs

/// A drive forwards through a left bend, with some sway.
Eigen::Isometry3d drivePose(int i) {
  Vector6d step;
  step << 0.0, 0.0, kStep, 0.0, -0.015, 0.0;
  Vector6d sway;
  sway << 0.0, 0.02 * std::sin(0.7 * i), 0.0, 0.004 * std::sin(0.5 * i), 0.0, 0.006 * std::sin(0.9 * i);
  Eigen::Isometry3d T_origin_camera = Eigen::Isometry3d::Identity();
  for (int k = 0; k < i; ++k) T_origin_camera = T_origin_camera * expSE3(step);
  return T_origin_camera * expSE3(sway);
}

const synthetic::World& street() {
  static const synthetic::World world = synthetic::randomWorld(1, 5000, {-40.0, -4.0, -5.0}, {30.0, 3.0, 70.0});
  return world;
}

std::int64_t stampOf(int i) {
  return 1000000000 + i * kPeriod;
}

/// Pair i as a camera at a pose in a world sees it to a depth of `reach` m; pixels are off by `noise` px each.
StereoFeatures pairAt(const Eigen::Isometry3d& T_world_camera, int i, const synthetic::World& world, double noise = 0.0,
                      unsigned seed = 1, double reach = 25.0) {
  synthetic::Sighting sighting;
  sighting.noise = noise;
  sighting.max_depth = reach;
  sighting.seed = seed;
  return synthetic::observe(world, synthetic::camera(), T_world_camera.inverse(), stampOf(i), sighting);
}

/// Pair i of the drive.
StereoFeatures pairOf(int i, double noise = 0.0) {
  synthetic::Sighting sighting;
  sighting.noise = noise;
  sighting.flipped = 0.03;
  sighting.strangers = 60;
  sighting.max_depth = 25.0;
  sighting.seed = 100 + static_cast<unsigned>(i);
  return synthetic::observe(street(), synthetic::camera(), drivePose(i).inverse(), stampOf(i), sighting);
}

/// Pair i of the same drive in another street, of which no map was made.
StereoFeatures pairElsewhere(int i) {
  static const synthetic::World other = synthetic::randomWorld(2, 5000, {-40.0, -4.0, -5.0}, {30.0, 3.0, 70.0});
  return pairAt(drivePose(i), i, other, 0.0, 1, 40.0);
}

/// Pair i in which nothing is seen.
StereoFeatures blindPair(int i) {
  return synthetic::noFeatures(synthetic::camera(), stampOf(i));
}

StereoFeatures refused(StereoFeatures features) {
  features.report.refused = true;
  return features;
}

/// Pair i in which everything is new, as after a jump to another place.
StereoFeatures strangePair(int i) {
  const auto seed = static_cast<unsigned>(i);
  const synthetic::World elsewhere = synthetic::randomWorld(500 + seed, 600, {-10.0, -4.0, 3.0}, {10.0, 3.0, 25.0});
  return pairAt(Eigen::Isometry3d::Identity(), i, elsewhere, 0.0, 900 + seed, 40.0);
}

/// An earlier pair's features with the stamp of pair i.
StereoFeatures stampedAs(int i, StereoFeatures features) {
  features.stamp = stampOf(i);
  return features;
}

/// Pair i of something that is fixed to the camera and covers the whole view.
StereoFeatures coveredPair(int i) {
  StereoFeatures covered = stampedAs(i, strangePair(0));
  for (float& u : covered.u) u += 0.01f * static_cast<float>(i);  // noise: no image is that of the pair before
  return covered;
}

/// The drive's pair i with depths that are all wrong: no motion explains its matches.
StereoFeatures pairOfWrongDepths(int i) {
  StereoFeatures wrong = pairOf(i);
  for (float& disparity : wrong.disparity) disparity *= 1.5f;
  return wrong;
}

/// Pair i of a drive of which only the stamps are wrong.
StereoFeatures pairStamped(int i, std::int64_t offset, double noise = 0.2) {
  StereoFeatures features = pairOf(i, noise);
  features.stamp += offset;
  return features;
}

double distanceBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

double angleBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return logSO3(a.linear().transpose() * b.linear()).norm();
}

Eigen::Isometry3d trueSinceStart(int i, int start = 0) {
  return drivePose(start).inverse() * drivePose(i);
}

/// In a state, and the reason has these words.
void expectState(const OdometryResult& result, TrackingState state, const std::string& words = "") {
  EXPECT_EQ(result.state, state) << result.reason;
  EXPECT_TRUE(contains(result.reason, words)) << result.reason;
}

/// To the bit.
void expectSame(const OdometryResult& a, const OdometryResult& b) {
  EXPECT_EQ(a.state, b.state);
  EXPECT_EQ(a.T_origin_camera.matrix(), b.T_origin_camera.matrix());
  EXPECT_EQ(a.pose_covariance, b.pose_covariance);
  EXPECT_EQ(a.dt, b.dt);
  EXPECT_EQ(a.inliers, b.inliers);
}

/// Squares of errors in units of their covariance.
double motionError(const OdometryResult& result, const Eigen::Isometry3d& truth) {
  return mahalanobisSquare(logSE3(result.T_previous_current.inverse() * truth), result.motion_covariance);
}
double poseError(const OdometryResult& result, const Eigen::Isometry3d& truth) {
  return mahalanobisSquare(logSE3(result.T_origin_camera.inverse() * truth), result.pose_covariance);
}

double positionSigma(const OdometryResult& result) {
  return std::sqrt(result.pose_covariance.topLeftCorner<3, 3>().trace());
}

void expectCovariance(const Matrix6d& covariance) {
  EXPECT_TRUE(covariance.allFinite());
  EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-9 * (1.0 + covariance.norm()));
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(covariance);
  EXPECT_GE(solver.eigenvalues().minCoeff(), -1e-12 * (1.0 + covariance.norm()));
}

void expectHealthy(const OdometryResult& result) {
  EXPECT_TRUE(result.T_origin_camera.matrix().allFinite());
  EXPECT_TRUE(result.T_previous_current.matrix().allFinite());
  const Eigen::Matrix3d& rotation = result.T_origin_camera.linear();
  EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  expectCovariance(result.pose_covariance);
  expectCovariance(result.motion_covariance);
  const bool is_plain = result.state == TrackingState::kTracking && result.has_motion;
  EXPECT_TRUE(is_plain || !result.reason.empty());
}

/// Learning it makes poses more certain. Without that, their covariance never shrinks.
VisualOdometryOptions knownRig() {
  VisualOdometryOptions options;
  options.calibration.enabled = false;
  options.calibration.right_delay_sigma = 1e-6;
  return options;
}

/// Follows the pairs 0 … last of the drive; the last result.
OdometryResult follow(VisualOdometry& odometry, int last, int first = 0) {
  OdometryResult result;
  for (int i = first; i <= last; ++i) result = odometry.update(pairOf(i));
  return result;
}

/// The odometry on pairs that are letters: (g)ood, (b)lind, (s)trange, (e)lsewhere or (c)overed. A point is a pair
/// that does not come, a bar breaks the stream, a space only divides.
struct Drive {
  explicit Drive(const VisualOdometryOptions& options = knownRig()) : odometry(options) {}

  /// The pairs' states by their first letters, with what divides them.
  std::string operator()(const std::string& pairs) {
    std::string states;
    for (const char kind : pairs) {
      if (kind == ' ' || kind == '.' || kind == '|') {
        states += kind;
        next += kind == '.';
        if (kind == '|') odometry.breakStream();
        continue;
      }
      const auto pair = kind == 'g'   ? pairOf(next)
                        : kind == 'b' ? blindPair(next)
                        : kind == 's' ? strangePair(next)
                        : kind == 'e' ? pairElsewhere(next)
                        : kind == 'r' ? refused(blindPair(next))
                                      : coveredPair(next);
      last = odometry.update(pair, guess ? std::optional(guess(next)) : std::nullopt);
      SCOPED_TRACE("pair " + std::to_string(next) + " of " + pairs + ": " + last.reason);
      expectConsistency();
      ++next;
      states += toString(last.state)[0];
    }
    return states;
  }

  /// Whatever the pairs show.
  void expectConsistency() {
    const bool has_pose = last.state == TrackingState::kTracking || last.state == TrackingState::kDegraded;
    expectHealthy(last);
    EXPECT_EQ(last.has_pose, has_pose);
    EXPECT_TRUE(has_pose || !last.has_motion);
    if (!has_pose) return;
    if (!before) {
      start = next;
      EXPECT_TRUE(last.T_origin_camera.isApprox(Eigen::Isometry3d::Identity()));
    } else {
      EXPECT_EQ(last.has_motion, last.epoch == before->epoch) << "it would begin at a pose that was not published";
      if (last.has_motion) {
        EXPECT_TRUE((before->T_origin_camera * last.T_previous_current).isApprox(last.T_origin_camera, 1e-9));
        EXPECT_NEAR(last.dt, 1e-9 * static_cast<double>(last.stamp - before->stamp), 1e-12);
      }
      if (last.epoch < before->epoch) measured = 0.0;  // the map from before is found again
      EXPECT_GE(last.pose_covariance.trace(), (1.0 - 1e-9) * measured) << "but for rounding";
      EXPECT_GE(last.distance, before->distance);
    }
    before = last;
    if (last.state == TrackingState::kTracking) measured = last.pose_covariance.trace();
  }

  /// So far no epoch ended, and the last pose is true to so many m.
  void expectTruth(double tolerance) const {
    EXPECT_EQ(last.epoch, 0);
    EXPECT_LT(distanceBetween(last.T_origin_camera, trueSinceStart(next - 1, start)), tolerance) << next - 1;
  }

  VisualOdometry odometry;
  std::function<MotionGuess(int)> guess;
  int start = 0, next = 0;  ///< pairs
  OdometryResult last;

 private:
  std::optional<OdometryResult> before;  ///< with a pose
  double measured = 0.0;                 ///< trace of the last measured pose's covariance
};

/// States that are any are question marks.
bool agree(const std::string& states, const std::string& expected) {
  return std::equal(states.begin(), states.end(), expected.begin(), expected.end(),
                    [](char state, char wanted) { return wanted == '?' || state == wanted; });
}

TEST(VisualOdometry, StatesFollowFromWhatThePairsShow) {
  struct Scenario {
    std::string pairs, states, why;
    int epoch = 0;
    std::string words{};  ///< of the last reason
  };
  for (const Scenario& s : std::vector<Scenario>{
           {"bbb gg", "WWW TT", "waits for the first features"},
           {"g b", "T L", "there is no motion to predict"},
           {"gggggg bgbgbgbg", "TTTTTT DTDTDTDT", "it may predict again once it has measured"},
           {"gggg.g.g b", "TTTT.T.T D", "speed is by the clock"},
           {"gggggggg b gggggg bbb ggggggg", "TTTTTTTT D TTTTTT DLL TTTTTTT", "found again in the map"},
           {"gggggg sss gg", "TTTTTT DLL TT", "pairs of another street leave the map"},
           {"gggggg|e b", "TTTTTT|L L", "a velocity is of no use after a break"},
           {"gggggg ...|ee", "TTTTTT ...|LD", "a broken stream starts again", 1, "started again from the last pose"},
           // Foreign images that agree with each other are a place of their own; the map from before is not lost by it.
           {"gggggg eee", "TTTTTT DLD", "another place is another map", 1},
           {"gggggg eee gggg gggg", "TTTTTT DLD ???T TTTT", "comes back to its map"},
           // Left and right of its pairs may be of two moments, as those before were.
           {"gggggg b rrr eee", "TTTTTT D LLL LDD", "doubts a map after refused pairs", 1, "did not belong together"},
           {"gggggg b rrr eee eeeee", "TTTTTT D LLL LDD ????T", "but not for long", 1},
           {"gggggg rr ggg", "TTTTTT ?? ??T", "lasting points refute it"},
       }) {
    SCOPED_TRACE(s.pairs + ": " + s.why);
    Drive drive;
    const std::string states = drive(s.pairs);
    EXPECT_TRUE(agree(states, s.states)) << states << " in place of " << s.states;
    EXPECT_EQ(drive.last.epoch, s.epoch);
    EXPECT_TRUE(contains(drive.last.reason, s.words)) << drive.last.reason;
    if (s.epoch > 0) continue;
    if (s.states.back() == 'T') drive.expectTruth(0.02);
    if (s.states.back() == 'D') drive.expectTruth(0.1);
  }
}

/// A guess that is too long by 5 % bridges an outage. Where it leads to a street of which no map was made, one begins,
/// and no pose is missing on the way.
TEST(VisualOdometry, AGuessHasAPoseForEachPairOfAnOutage) {
  for (const auto& [pairs, states, scale] : std::vector<std::tuple<std::string, std::string, double>>{
           {"sss gg", "DDD TT", 1.05}, {"eeeeeee", "DDTTTTT", 1.0}}) {
    Drive drive;
    drive("gggggg");
    drive.guess = [factor = scale](int i) {
      Vector6d motion = logSE3(trueSinceStart(i, i - 1));
      motion.head<3>() *= factor;
      return MotionGuess{expSE3(motion)};
    };
    EXPECT_EQ(drive(pairs), states);
    drive.expectTruth(0.02);
  }
}

TEST(VisualOdometry, NamesTheMapsLastKeyframe) {
  Drive drive;
  std::vector<std::int64_t> ids;
  for (const char* pair : {"g", "g", "b", "b", "g"}) drive(pair), ids.push_back(drive.last.keyframe_id);
  EXPECT_EQ(ids, (std::vector<std::int64_t>{1, 2, 2, 0, 5})) << "every pair is one; a lost odometry has none";
}

TEST(VisualOdometry, FollowsAnExactDriveFromItsFirstPair) {
  VisualOdometry odometry({});
  double travelled = 0.0;
  for (int i = 0; i <= 30; ++i) {
    const OdometryResult result = odometry.update(pairOf(i));
    ASSERT_EQ(result.state, TrackingState::kTracking) << i << ": " << result.reason;
    ASSERT_TRUE(result.has_pose);
    expectHealthy(result);
    EXPECT_EQ(result.stamp, stampOf(i));
    EXPECT_EQ(result.features, pairOf(i).count());
    EXPECT_EQ(result.has_motion, i > 0);
    // Pixels are stored as 32-bit floats, good to 3e-5 px: at 25 m that is 1e-4 m of depth for one point.
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), i == 0 ? 1e-12 : 1e-3) << i;
    EXPECT_LT(angleBetween(result.T_origin_camera, trueSinceStart(i)), i == 0 ? 1e-12 : 1e-4) << i;
    if (i > 0) travelled += trueSinceStart(i, i - 1).translation().norm();
    EXPECT_NEAR(result.distance, travelled, i == 0 ? 0.0 : 0.01);
    if (i == 0) continue;
    EXPECT_EQ(result.reason, "");
    EXPECT_NEAR(result.dt, 0.1, 1e-12);
    EXPECT_LT(distanceBetween(result.T_previous_current, trueSinceStart(i, i - 1)), 1e-3);
    EXPECT_GT(result.inliers, 50);
    EXPECT_LE(result.inliers, result.matches);
    EXPECT_LE(result.matches, result.features);
    EXPECT_EQ(result.flow.size(), static_cast<std::size_t>(result.matches));
    EXPECT_EQ(std::count_if(result.flow.begin(), result.flow.end(), [](const FeatureFlow& f) { return f.inlier; }),
              result.inliers);
    EXPECT_GT(result.coverage, 0.5);
    EXPECT_LT(result.rms, 0.01);
  }
}

TEST(VisualOdometry, FollowsANoisyDriveAndKnowsHowWell) {
  constexpr double kNoise = 0.3;  // px
  VisualOdometry odometry(knownRig());
  OdometryResult result;
  constexpr int kPairs = 40;
  for (int i = 0; i <= kPairs; ++i) {
    result = odometry.update(pairOf(i, kNoise));
    ASSERT_EQ(result.state, TrackingState::kTracking) << i << ": " << result.reason;
    expectHealthy(result);
  }
  EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(kPairs)), 0.01 * kPairs * kStep);
  EXPECT_LT(angleBetween(result.T_origin_camera, trueSinceStart(kPairs)), 0.01);
  EXPECT_LT(poseError(result, trueSinceStart(kPairs)), 4.0 * 38.0);
}

TEST(VisualOdometry, APairWithNoisierImagesHasALargerCovarianceAndTheNextOnesHaveNot) {
  constexpr double kNoise = 0.15;  // px
  constexpr int kNoisy = 30;
  VisualOdometry odometry({});
  std::vector<double> variances;
  for (int i = 0; i <= kNoisy + 2; ++i) {
    const OdometryResult result = odometry.update(pairOf(i, i == kNoisy ? 3.0 * kNoise : kNoise));
    ASSERT_EQ(result.state, TrackingState::kTracking) << i << ": " << result.reason;
    variances.push_back(result.motion_covariance.trace());
  }
  const double usual = *std::max_element(variances.begin() + kNoisy - 10, variances.begin() + kNoisy);
  EXPECT_GT(variances[kNoisy], 4.0 * usual) << "it ends noisily";
  EXPECT_GT(variances[kNoisy + 1], 4.0 * usual) << "it begins noisily";
  EXPECT_LT(variances[kNoisy + 2], 2.0 * usual);
}

TEST(VisualOdometry, PassesOnWhyThereAreNoFeatures) {
  VisualOdometry odometry({});
  StereoFeatures dark = blindPair(0);
  dark.report.status = "the lens is covered";
  EXPECT_TRUE(contains(odometry.update(dark).reason, "the lens is covered"));
  follow(odometry, 2, 1);
  dark.stamp = stampOf(3);
  EXPECT_TRUE(contains(odometry.update(dark).reason, "the lens is covered"));
}

TEST(VisualOdometry, BridgesOneFailedPairByPrediction) {
  for (const std::string failed : {"b", "s"}) {
    Drive drive;
    ASSERT_EQ(drive("gggggg"), "TTTTTT");
    const OdometryResult before = drive.last;
    ASSERT_EQ(drive(failed), "D");
    drive.expectTruth(0.1);  // at constant velocity: the sway of the drive is a few centimetres
    EXPECT_GT(drive.last.pose_covariance.trace(), 2.0 * before.pose_covariance.trace());
    EXPECT_GT(drive.last.motion_covariance.trace(), 2.0 * before.motion_covariance.trace());
    ASSERT_EQ(drive("g"), "T") << drive.last.reason;
    drive.expectTruth(0.01);  // the prediction's error does not stay
    EXPECT_EQ(drive("g"), "T");
  }
}

TEST(VisualOdometry, APredictionContainsTheMotionOfAPairWhoseStampIsThatOfABurst) {
  VisualOdometry odometry({});
  follow(odometry, 5);
  StereoFeatures burst = blindPair(6);
  burst.stamp = stampOf(5) + 1000000;  // ns
  const OdometryResult predicted = odometry.update(burst);
  ASSERT_TRUE(predicted.has_motion) << predicted.reason;
  const Eigen::Isometry3d moved = trueSinceStart(6, 5);
  EXPECT_GT(logSE3(predicted.T_previous_current.inverse() * moved).norm(), 0.5 * kStep)
      << "a millisecond's way is predicted";
  EXPECT_LT(motionError(predicted, moved), 25.0);
}

/// Its velocity is over an interval as before, not over the millisecond of its stamps.
TEST(VisualOdometry, AMeasuredPairOfABurstPredictsNoLeap) {
  const auto slow = [](int i) { return Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 0.03 * i)); };
  VisualOdometry odometry({});
  for (int i = 0; i <= 8; ++i) odometry.update(pairAt(slow(i), i, street()));
  StereoFeatures burst = pairAt(slow(9), 9, street());
  burst.stamp = stampOf(8) + 1000000;  // ns
  ASSERT_TRUE(odometry.update(burst).has_motion);
  const OdometryResult predicted = odometry.update(blindPair(10));
  ASSERT_TRUE(predicted.has_motion) << predicted.reason;
  EXPECT_LT(distanceBetween(predicted.T_previous_current, slow(1)), 0.1) << "not the 6 m of 30 m/s";
  EXPECT_LT(motionError(predicted, slow(1)), 25.0);
}

TEST(VisualOdometry, AGyrosTranslationIsNoWayOfTheNextGuess) {
  const auto covarianceAfter = [](double translation) {
    Outage outage;
    MotionGuess turn, whole;
    turn.rotation_only = true;
    turn.T_previous_current.translation().x() = translation;
    outage.extend(0.1, turn, MotionPrior{TrackingOptions()});
    outage.extend(0.1, whole, MotionPrior{TrackingOptions()});
    return outage.guessedMotion()->covariance;
  };
  EXPECT_EQ(covarianceAfter(100.0), covarianceAfter(0.0));
}

TEST(VisualOdometry, AMotionThatNoRobotMakesCostsOnePair) {
  VisualOdometryOptions options;
  options.tracking.max_speed = 12.0;                          // the drive goes at 8 m/s
  for (const std::int64_t after : {kPeriod / 10, kPeriod}) {  // two steps: 160 and 16 m/s
    VisualOdometry odometry(options);
    expectState(follow(odometry, 5), TrackingState::kTracking);
    expectState(odometry.update(pairStamped(7, after - 2 * kPeriod, 0.0)), TrackingState::kDegraded, "max_speed");
    const OdometryResult next = odometry.update(pairOf(8));
    expectState(next, TrackingState::kTracking);
    EXPECT_EQ(next.epoch, 0);
    EXPECT_LT(distanceBetween(next.T_origin_camera, trueSinceStart(8)), 0.01);
  }
}

/// Rows as a right camera sees them that is turned about its axis, rad.
StereoFeatures pairWithRightTurnedBy(double roll, int i) {
  StereoFeatures features = pairOf(i);
  for (int k = 0; k < features.count(); ++k)
    features.dv[k] -= static_cast<float>(roll * (features.u[k] - features.disparity[k] - features.camera.cx));
  return features;
}

TEST(VisualOdometry, ARightCameraThatTurnsUnderWayIsWatched) {
  for (const bool much : {false, true}) {
    VisualOdometry odometry({});
    expectState(follow(odometry, 5), TrackingState::kTracking);
    const OdometryResult result = odometry.update(pairWithRightTurnedBy(much ? 8e-3 : 0.5e-3, 6));
    EXPECT_EQ(result.state, much ? TrackingState::kDegraded : TrackingState::kTracking) << result.reason;
    EXPECT_EQ(contains(result.reason, "the right camera"), much) << result.reason;
    expectState(follow(odometry, 15, 7), TrackingState::kTracking);
  }
}

TEST(VisualOdometry, AYawOfTheRightCameraThatNoMotionExplainsIsCompensated) {
  for (const double degrees : {-1.0, -0.5, 0.5, 1.0}) {
    SCOPED_TRACE(degrees);
    const Eigen::Vector3d yaw(0.0, degrees * CV_PI / 180.0, 0.0);
    VisualOdometry odometry({});
    expectState(follow(odometry, 5), TrackingState::kTracking);
    OdometryResult result = odometry.update(rotatedBack(pairOf(6), -yaw));
    expectState(result, TrackingState::kDegraded, "the right camera seems to have turned");
    for (int i = 7; i <= 15; ++i) result = odometry.update(rotatedBack(pairOf(i), -yaw));
    expectState(result, TrackingState::kTracking);
    EXPECT_EQ(result.epoch, 0);
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(15)),
              0.03 * trueSinceStart(15).translation().norm());
  }
}

TEST(VisualOdometry, IsLostAfterTheSecondFailureAndStartsAgainFromTheLastPose) {
  Drive drive;
  ASSERT_EQ(drive("gggggg b"), "TTTTTT D");
  const OdometryResult predicted = drive.last;
  ASSERT_EQ(drive("bbb ee"), "LLL LD") << "the map is kept until another one has a measured pair";
  const OdometryResult again = drive.last;
  EXPECT_TRUE(contains(again.reason, "started again from the last pose")) << again.reason;
  EXPECT_EQ(again.epoch, 1);
  const Eigen::Isometry3d begun = again.T_origin_camera * trueSinceStart(11, 10).inverse();
  EXPECT_LT(distanceBetween(begun, predicted.T_origin_camera), 1e-3) << "not the last published pose";
  EXPECT_GT(again.pose_covariance.trace(), predicted.pose_covariance.trace());
  for (int i = 12; i <= 15; ++i) {
    EXPECT_EQ(drive("e"), "T") << drive.last.reason;
    EXPECT_EQ(drive.last.epoch, 1);
    EXPECT_LT(distanceBetween(drive.last.T_origin_camera, begun * trueSinceStart(i, 10)), 1e-3);
    EXPECT_GE(drive.last.pose_covariance.trace(), again.pose_covariance.trace());
  }
}

/// A camera that stood for some pairs, and knows it, then turns by 25 degrees at once; a texture that repeats itself
/// leaves nothing to be found but near where it is expected.
class GuessedTurn : public ::testing::Test {
 protected:
  GuessedTurn() {
    for (std::size_t i = 0; i < world_.rows.size(); ++i) world_.rows[i] = world_.rows[i % 80];
    for (int i = 0; i < 6; ++i) result_ = odometry_.update(pairFrom(still_, i), MotionGuess{still_});
    expectState(result_, TrackingState::kTracking);
  }

  StereoFeatures pairFrom(const Eigen::Isometry3d& pose, int i) const {
    return pairAt(pose, i, world_, 0.1, 700 + static_cast<unsigned>(i), 40.0);
  }

  void expectTracked(const Eigen::Isometry3d& truth, double tolerance) const {
    expectState(result_, TrackingState::kTracking);
    EXPECT_LT(angleBetween(result_.T_origin_camera, truth), 1e-3);
    EXPECT_LT(distanceBetween(result_.T_origin_camera, truth), tolerance);
  }

  const Eigen::Isometry3d still_ = Eigen::Isometry3d::Identity();
  const Eigen::Isometry3d turn_{Eigen::AngleAxisd(25.0 / 180.0 * M_PI, Eigen::Vector3d::UnitY())};
  synthetic::World world_ = synthetic::randomWorld(41, 1600, {-12.0, -4.0, 4.0}, {25.0, 3.0, 15.0});
  VisualOdometry odometry_{{}};
  OdometryResult result_;
};

TEST_F(GuessedTurn, IsLostWithoutAGuess) {
  result_ = odometry_.update(pairFrom(turn_, 6));
  EXPECT_NE(result_.state, TrackingState::kTracking);
  EXPECT_GT(angleBetween(result_.T_origin_camera, turn_), 0.2);
}

TEST_F(GuessedTurn, IsTrackedWithOne) {
  const Eigen::Isometry3d about = turn_ * expSE3((Vector6d() << 0.02, -0.01, 0.03, 0.01, 0.02, -0.01).finished());
  result_ = odometry_.update(pairFrom(turn_, 6), MotionGuess{about});
  expectTracked(turn_, 0.01);  // the guess is 0.04 m off
}

TEST_F(GuessedTurn, ARotationAloneWillDo) {
  result_ = odometry_.update(pairFrom(turn_, 6), MotionGuess{Eigen::Translation3d(3.0, 0.0, 3.0) * turn_, true});
  expectTracked(turn_, 0.01);
}

TEST_F(GuessedTurn, AWrongGuessDoesNoHarm) {
  for (int i = 6; i < 10; ++i) {
    result_ = odometry_.update(pairFrom(still_, i), MotionGuess{i % 2 ? turn_ : turn_.inverse()});
    expectTracked(still_, 0.01);
  }
}

/// A cover that fills the view seems to stand. A camera with the velocity before hardly does: 8 m/s could be gone in a
/// pair or two.
TEST(VisualOdometry, DoesNotTrustAStandstillRightAfterALossOnTheWay) {
  Drive drive;
  drive("gggggg");
  for (int i = 6; i <= 15; ++i) {
    EXPECT_NE(drive("c"), "T") << i;
    if (drive.last.has_motion) {
      EXPECT_LT(motionError(drive.last, trueSinceStart(i, i - 1)), 20.0) << i;
    }
    if (i == 10) {
      EXPECT_TRUE(drive.last.has_motion && contains(drive.last.reason, "the prior")) << drive.last.reason;
    }
  }
  EXPECT_EQ(drive(std::string(25, 'c')).back(), 'T') << "it may have stopped after all: " << drive.last.reason;
}

TEST(VisualOdometry, DoubtsTheNextMapWhereManyMatchesAgreedOnNoMotion) {
  // A right camera that is late while the camera moves to the side: the depths are wrong, in every pair alike.
  VisualOdometry odometry({});
  follow(odometry, 5);
  std::map<TrackingState, int> count;
  for (int i = 6; i <= 10; ++i) {
    const OdometryResult result = odometry.update(pairOfWrongDepths(i));
    ++count[result.state];
    EXPECT_TRUE(!result.has_motion || motionError(result, trueSinceStart(i, i - 1)) < 20.0) << i;
  }
  EXPECT_EQ(count[TrackingState::kTracking], 0);
  EXPECT_GE(count[TrackingState::kLost], 1);
  EXPECT_GE(count[TrackingState::kDegraded], 3) << "a map of the wrong depths explains one another's pairs";
}

/// A result with a defect is not published: the odometry is lost, names it, and goes on from the last sound pose.
TEST(VisualOdometry, ACovarianceThatIsNoneIsLostAndGoesOn) {
  VisualOdometry odometry({});
  const OdometryResult before = follow(odometry, 8);
  odometry.setPoseCovariance(1e308 * Matrix6d::Identity());  // the next motion multiplies it beyond all numbers
  const OdometryResult lost = odometry.update(pairOf(9));
  expectState(lost, TrackingState::kLost, "covariance of the pose is not finite");
  EXPECT_FALSE(lost.has_pose);
  // The guess of the last motion alone does not reach back to the sound pose.
  const OdometryResult again = odometry.update(pairOf(10), MotionGuess{trueSinceStart(10, 9), false, 0.1});
  expectState(again, TrackingState::kDegraded, "started again");
  EXPECT_GT(again.epoch, lost.epoch);
  EXPECT_TRUE(again.T_origin_camera.isApprox(before.T_origin_camera));
  EXPECT_GT(positionSigma(again), 1.0) << "the motion in between is unknown";
  const OdometryResult last = follow(odometry, 14, 11);
  expectState(last, TrackingState::kTracking);
  expectHealthy(last);
}

TEST(VisualOdometry, RefusesGuessesMountsAndCovariancesThatAreNone) {
  VisualOdometry odometry({}), undisturbed({});
  follow(odometry, 4), follow(undisturbed, 4);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MotionGuess scaled, unknown, exact;
  scaled.T_previous_current.linear() *= 1.1;
  unknown.T_previous_current.translation().x() = nan;
  exact.error = 0.0;
  for (const MotionGuess& guess : {scaled, unknown, exact})
    EXPECT_THROW(odometry.update(pairOf(5), guess), std::invalid_argument);
  EXPECT_THROW(odometry.mountAt(scaled.T_previous_current), std::invalid_argument);
  EXPECT_THROW(odometry.mountAt(unknown.T_previous_current), std::invalid_argument);
  EXPECT_THROW(odometry.setPoseCovariance(nan * Matrix6d::Identity()), std::invalid_argument);
  EXPECT_THROW(odometry.setPoseCovariance(-Matrix6d::Identity()), std::invalid_argument);
  EXPECT_THROW(odometry.setPoseCovariance(Matrix6d::Identity() - Matrix6d::Ones()), std::invalid_argument);
  expectSame(odometry.update(pairOf(5)), undisturbed.update(pairOf(5)));
}

TEST(VisualOdometry, DoesNotDoubtForLongWhatComesAfterAGap) {
  constexpr std::int64_t kGap = 3000000000;  // ns
  VisualOdometry odometry({});
  follow(odometry, 5);
  StereoFeatures first = pairOfWrongDepths(6);  // as many wrong matches as there may be
  first.stamp += kGap;
  expectState(odometry.update(first), TrackingState::kLost);
  for (int i = 7; i <= 10; ++i) odometry.update(pairStamped(i, kGap, 0.0));
  expectState(odometry.update(pairStamped(11, kGap, 0.0)), TrackingState::kTracking);
}

TEST(VisualOdometry, DoesNotPredictOverALongGap) {
  VisualOdometryOptions options = knownRig();
  options.tracking.max_gap = 0.5;
  EXPECT_EQ(Drive(options)("gggggg .... b"), "TTTTTT .... D");
  EXPECT_EQ(Drive(options)("gggggg ..... b"), "TTTTTT ..... L");
}

TEST(VisualOdometry, RefusesBrokenPairsAndGoesOn) {
  VisualOdometry disturbed({}), undisturbed({});
  follow(disturbed, 5);
  follow(undisturbed, 5);
  const Refusals<StereoFeatures> refusals = {
      {[](StereoFeatures& f) { f.stamp = stampOf(5); }, "stamp"},
      {[](StereoFeatures& f) { f.stamp = stampOf(2); }, "stamp"},
      {[](StereoFeatures& f) { f.disparity[0] = std::numeric_limits<float>::quiet_NaN(); }, "disparity"},
      {[](StereoFeatures& f) { f.v.pop_back(); }, "array v"},
      {[](StereoFeatures& f) { f.descriptors.convertTo(f.descriptors, CV_32F); }, "descriptors"},
      {[](StereoFeatures& f) {
         f.element_type = ElementType::kFloat32;
         f.descriptors = f.descriptors.colRange(0, 126).clone();
       },
       "126 bytes"}};
  for (const auto& [damage, words] : refusals) {
    StereoFeatures broken = pairOf(6);
    damage(broken);
    expectError([&, pair = broken] { disturbed.update(pair); }, {words});
  }
  const OdometryResult a = disturbed.update(pairOf(6)), b = undisturbed.update(pairOf(6));
  expectSame(a, b);
  EXPECT_EQ(a.epoch, b.epoch);
}

TEST(VisualOdometry, ResetReturnsToTheOriginUnderANewEpoch) {
  VisualOdometry odometry({}), fresh({});
  const OdometryResult before = follow(odometry, 8);
  odometry.reset();
  for (int i = 2; i <= 6; ++i) {  // the clock may have gone back
    const OdometryResult again = odometry.update(pairOf(i));
    expectSame(again, fresh.update(pairOf(i)));
    EXPECT_EQ(again.epoch, before.epoch + 1);
    if (i > 2) continue;
    EXPECT_TRUE(again.T_origin_camera.isApprox(Eigen::Isometry3d::Identity()));
    EXPECT_LT(again.pose_covariance.trace(), before.pose_covariance.trace());
    EXPECT_EQ(again.distance, 0.0);
    EXPECT_FALSE(again.has_motion);
  }
}

TEST(VisualOdometry, GoesOnWithALensThatFocuses) {
  VisualOdometry odometry({});
  for (int i = 0; i <= 20; ++i) {
    StereoCamera camera = synthetic::camera();
    const double change = 0.04 * std::sin(i);  // up to 20 px of the focal length, each pair another one
    camera.fx *= 1.0 + change;
    camera.fy *= 1.0 + 0.9 * change;
    camera.cx += 100.0 * change;
    camera.cy -= 50.0 * change;
    camera.baseline *= 1.0 - change;
    const OdometryResult result =
        odometry.update(synthetic::observe(street(), camera, drivePose(i).inverse(), stampOf(i)));
    ASSERT_EQ(result.state, TrackingState::kTracking) << i << ": " << result.reason;
    EXPECT_EQ(result.epoch, 0);
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), 1e-3) << i;
  }
}

/// The street's pairs as a driver gives them whose calibration is wrong for some pairs.
StereoFeatures pairWith(int i, double fx, double cx, double baseline) {
  StereoFeatures features = pairOf(i);
  features.camera.fx *= fx, features.camera.fy *= fx, features.camera.cx += cx, features.camera.baseline *= baseline;
  return features;
}

TEST(VisualOdometry, ImagesRefuteACameraThatTheyDoNotShow) {
  for (const auto& [fx, cx, baseline] : std::vector<std::array<double, 3>>{{1.03, 0, 1}, {1, 12, 1}, {1, 0, 1.04}}) {
    VisualOdometry odometry({});
    follow(odometry, 8);
    for (int i = 9; i <= 14; ++i) {
      const bool is_wrong = i < 12;
      const OdometryResult result = odometry.update(is_wrong ? pairWith(i, fx, cx, baseline) : pairOf(i));
      expectState(result, TrackingState::kTracking);
      EXPECT_EQ(is_wrong, result.reason.find("camera_info") != std::string::npos) << i << ": " << result.reason;
      EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), 5e-3) << i;
    }
  }
}

TEST(VisualOdometry, ACalibrationThatLastsIsTaken) {
  VisualOdometry odometry({});
  OdometryResult last = follow(odometry, 8);
  const int taken = 8 + static_cast<int>(1e9 * odometry.options().tracking.max_gap / kPeriod) + 1;
  for (int i = 9; i <= taken + 5; ++i) {
    const OdometryResult result = odometry.update(pairWith(i, 1.0, 0.0, 1.04));
    expectState(result, TrackingState::kTracking);
    EXPECT_EQ(result.epoch, last.epoch);
    EXPECT_EQ(i <= taken, result.reason.find("camera_info") != std::string::npos) << i << ": " << result.reason;
    const double scale = i <= taken ? 1.0 : 1.04;  // of a length by that baseline
    EXPECT_NEAR(result.T_previous_current.translation().norm(), scale * trueSinceStart(i, i - 1).translation().norm(),
                0.01 * scale);
  }
}

/// Of another camera, descriptor, or the same bytes to be read as numbers, which neither name nor width tells.
TEST(VisualOdometry, StartsAgainFromTheLastPoseWithOtherFeatures) {
  StereoCamera other = synthetic::camera();
  other.baseline = 0.3;
  other.fx = 380.0;
  const auto ofHalfTheRow = [](StereoFeatures features) {
    features.layout = DescriptorLayout::kLeft;
    features.descriptors = features.descriptors.colRange(0, 64).clone();
    return features;
  };
  const auto ofNumbers = [](StereoFeatures features) {
    features.element_type = ElementType::kUint8;
    return features;
  };
  const std::vector<std::function<StereoFeatures(int)>> others = {
      [&](int i) { return synthetic::observe(street(), other, drivePose(i).inverse(), stampOf(i)); },
      [&](int i) { return ofHalfTheRow(pairOf(i)); }, [&](int i) { return ofNumbers(pairOf(i)); }};
  for (const auto& otherPair : others) {
    VisualOdometry odometry({});
    const OdometryResult before = follow(odometry, 5), again = odometry.update(otherPair(6));
    EXPECT_TRUE(again.has_pose);
    EXPECT_FALSE(again.has_motion);
    EXPECT_EQ(again.epoch, before.epoch + 1);
    EXPECT_TRUE(again.T_origin_camera.isApprox(before.T_origin_camera, 1e-9));
    EXPECT_GT(again.pose_covariance.trace(), before.pose_covariance.trace());
    EXPECT_TRUE(std::isfinite(before.disparity_offset) && std::isfinite(before.right_rotation.norm()));
    EXPECT_EQ(std::isnan(again.disparity_offset_sigma), otherPair(6).camera == other)
        << "what was learnt was of another rig";
    const OdometryResult next = odometry.update(otherPair(7));
    expectState(next, TrackingState::kTracking);
    EXPECT_LT(distanceBetween(next.T_origin_camera, again.T_origin_camera * trueSinceStart(7, 6)), 1e-3);
  }
}

TEST(VisualOdometry, AnotherCameraOfTheRobotGoesOnFromTheBasesPose) {
  const Eigen::Isometry3d T_base_a = Eigen::Translation3d(0.4, 0.1, 0.5) * Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  const Eigen::Isometry3d T_a_b =
      Eigen::Translation3d(-0.2, 0.1, -0.3) * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY());
  const Eigen::Isometry3d T_base_b = T_base_a * T_a_b;
  VisualOdometry odometry({});
  odometry.mountAt(T_base_a);
  const OdometryResult before = follow(odometry, 5);
  for (int i = 6; i <= 10; ++i) {
    odometry.mountAt(T_base_b);
    const OdometryResult after = odometry.update(
        synthetic::observe(street(), synthetic::camera(), (drivePose(i) * T_a_b).inverse(), stampOf(i)));
    EXPECT_EQ(after.epoch, before.epoch + 1) << i;
    EXPECT_EQ(after.has_motion, i > 6) << i;
    EXPECT_GT(after.pose_covariance.trace(), before.pose_covariance.trace());
    // The base stays where it was, and moves from there as both cameras see it.
    const Eigen::Isometry3d expected = T_base_a * before.T_origin_camera * trueSinceStart(i, 6) * T_base_a.inverse();
    const Eigen::Isometry3d base = T_base_b * after.T_origin_camera * T_base_b.inverse();
    EXPECT_LT(distanceBetween(base, expected), 2e-3) << i;
    EXPECT_LT(angleBetween(base, expected), 1e-3) << i;
  }
}

/// In the new camera's axes the velocity from before would make each motion a doubtful one. Guesses count from the last
/// pose on.
TEST(VisualOdometry, AMountThatTurnsFarLeavesNoVelocityToExpect) {
  const Eigen::Isometry3d T_before_now(Eigen::AngleAxisd(0.5 * CV_PI, Eigen::Vector3d::UnitY()));
  const Eigen::Isometry3d T_base_before(Eigen::Translation3d(0.4, 0.1, 0.5));
  const auto turned = [&](const Eigen::Isometry3d& motion) { return T_before_now.inverse() * motion * T_before_now; };
  for (const bool is_guessed : {true, false})
    for (const bool is_blind : {true, false}) {  // before the change
      VisualOdometry odometry({});
      odometry.mountAt(T_base_before);
      OdometryResult before = follow(odometry, 8);
      for (int i = 9; i <= 11; ++i) before = odometry.update(is_blind ? blindPair(i) : pairOf(i));
      ASSERT_EQ(before.has_pose, !is_blind);
      odometry.mountAt(T_base_before * T_before_now);
      const bool goes_on = is_guessed && !is_blind;
      for (int i = 12; i <= 17; ++i) {
        const StereoFeatures pair = pairAt(drivePose(i) * T_before_now, i, street());
        const std::optional<MotionGuess> guess{{turned(trueSinceStart(i, i - 1)), false, 0.1}};
        const OdometryResult after = odometry.update(pair, is_guessed ? guess : std::nullopt);
        EXPECT_EQ(after.epoch, before.epoch + !goes_on) << i;
        if (i == 12) continue;
        expectState(after, TrackingState::kTracking);
        EXPECT_GT(after.probability, 0.99) << i;
      }
    }
}

/// A pose that is set after the change is where the next pair begins, as after each interruption.
TEST(VisualOdometry, APoseThatIsSetAfterAnotherMountIsKept) {
  VisualOdometry odometry({});
  const OdometryResult before = follow(odometry, 8);
  odometry.mountAt(Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 1.0)));
  odometry.setPoseCovariance(0.01 * Matrix6d::Identity());
  const OdometryResult after = odometry.update(pairOf(9));
  EXPECT_EQ(after.epoch, before.epoch + 1);
  EXPECT_LT(positionSigma(after), 0.2);
}

TEST(VisualOdometry, AnotherCameraWithAGyroHasNoMotionFromTheEpochBefore) {
  for (const bool rotation_only : {true, false}) {
    VisualOdometry odometry({});
    const OdometryResult before = follow(odometry, 8);
    StereoFeatures pair = pairOf(9);
    pair.camera.baseline *= 1.5;
    const OdometryResult after = odometry.update(pair, MotionGuess{trueSinceStart(9, 8), rotation_only, 0.1});
    EXPECT_TRUE(after.has_pose);
    EXPECT_EQ(after.epoch, before.epoch + rotation_only);
    EXPECT_EQ(after.has_motion, !rotation_only);
  }
}

TEST(VisualOdometry, AnotherReadoutIsTakenOverWithTheNextEstimate) {
  VisualOdometryOptions given, estimated;
  given.calibration.readout = 0.01;
  for (const bool begins_given : {true, false}) {
    VisualOdometry odometry(begins_given ? given : estimated);
    follow(odometry, 4);
    odometry.configure(begins_given ? estimated : given);
    EXPECT_EQ(odometry.update(pairOf(5)).used_readout, begins_given ? 0.01 : 0.0);
    EXPECT_EQ(odometry.update(pairOf(6)).used_readout, begins_given ? 0.01 : 0.0);
    odometry.reset();
    EXPECT_EQ(odometry.update(pairOf(7)).used_readout, begins_given ? 0.0 : 0.01);
  }
}

/// Along the street at 0.4 m/s, which the prior lets it stop within a pair, after `standing` pairs.
Eigen::Isometry3d slowPose(int i, int standing = 0) {
  return Eigen::Isometry3d(Eigen::Translation3d(0.04 * std::max(i - standing, 0), 0.0, 0.0));
}

TEST(VisualOdometry, ImagesWithNoiseThatRepeatAreFrozenHoweverSlowTheCameraIs) {
  for (const double noise : {0.1, 0.0}) {
    VisualOdometry odometry({});
    const auto slowPair = [&](int i) {
      return pairAt(slowPose(i, 6), i, street(), noise, noise > 0.0 ? 50 + static_cast<unsigned>(i) : 50);
    };
    OdometryResult result;
    for (int i = 0; i <= 12; ++i) result = odometry.update(slowPair(i));
    ASSERT_EQ(result.state, TrackingState::kTracking) << result.reason;
    result = odometry.update(stampedAs(13, slowPair(12)));
    EXPECT_EQ(contains(result.reason, "is the driver frozen?"), noise > 0.0) << result.reason;
  }
}

/// No camera whose images have noise can give an image twice.
TEST(VisualOdometry, ImagesThatShowTheirNoiseAreFrozenFromTheFirstOneOn) {
  VisualOdometry odometry({});
  const auto noisyPair = [&](int i, int pose) {
    StereoFeatures pair = pairAt(slowPose(pose), i, street());
    pair.report.noise = 2.0;
    return pair;
  };
  for (int i = 0; i <= 8; ++i) expectState(odometry.update(noisyPair(i, i)), TrackingState::kTracking);
  for (int i = 9; i <= 14; ++i) expectState(odometry.update(noisyPair(i, 8)), TrackingState::kDegraded);
}

TEST(VisualOdometry, AStopAtOnceIsDoubtfulForAPairAndBelievedAfterIt) {
  VisualOdometry odometry({});
  /// At one pose after the other, from pair i on.
  const auto through = [&](int i, const std::vector<int>& poses) {
    OdometryResult last;
    for (const int pose : poses) last = odometry.update(pairAt(slowPose(pose), i++, street()));
    return last;
  };
  const OdometryResult moving = through(0, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  expectState(moving, TrackingState::kTracking);
  const OdometryResult first = through(9, {8});
  expectState(first, TrackingState::kDegraded, "images as of the previous pair");  // of a frozen driver
  EXPECT_LT(mahalanobisSquare(logSE3(moving.T_previous_current), first.motion_covariance), 20.0)
      << "it may have gone on";
  expectState(through(10, {8, 8, 8, 8, 8}), TrackingState::kTracking);
  // The map shows that it has not gone on.
  const OdometryResult again = through(15, {9, 10, 11, 12});
  EXPECT_EQ(again.epoch, moving.epoch);
  EXPECT_LT(positionSigma(again), 0.02);
}

TEST(VisualOdometry, APairThatComesTwiceIsMeasuredOnce) {
  VisualOdometry odometry({});
  follow(odometry, 5);
  for (int i = 6; i <= 20; ++i) {
    const OdometryResult result = odometry.update(pairOf(i));
    StereoFeatures copy = pairOf(i);
    copy.stamp += kPeriod / 2;
    const OdometryResult again = odometry.update(copy);
    if (i < 12) continue;
    EXPECT_EQ(result.state, TrackingState::kTracking) << result.reason;
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), 0.05);
    EXPECT_TRUE(contains(again.reason, "each pair comes twice")) << again.reason;
    EXPECT_TRUE(again.T_origin_camera.isApprox(result.T_origin_camera, 1e-9));
  }
}

TEST(VisualOdometry, VelocityAfterAPredictedPairIsTheTrueOne) {
  // Constant speed, then a stop while blind. The first pair seen again corrects the prediction; the correction is no
  // motion, so a pair predicted right after it must stand still too.
  VisualOdometry odometry({});
  follow(odometry, 5);
  odometry.update(blindPair(6));
  const OdometryResult seen = odometry.update(stampedAs(7, pairOf(5)));
  expectState(seen, TrackingState::kDegraded, "the prior");  // from 8 m/s: more than a robot's brakes can do
  ASSERT_LT(distanceBetween(seen.T_origin_camera, trueSinceStart(5)), 0.01);
  const OdometryResult predicted = odometry.update(blindPair(8));
  expectState(predicted, TrackingState::kDegraded);
  EXPECT_LT(distanceBetween(predicted.T_origin_camera, trueSinceStart(5)), 0.1);
}

TEST(VisualOdometry, AStepOfTheClockForgetsNothingOfTheRig) {
  VisualOdometry odometry({});
  const OdometryResult before = follow(odometry, 10), after = odometry.update(pairStamped(11, 86'400'000'000'000, 0.0));
  EXPECT_LT(after.disparity_offset_sigma, 1.5 * before.disparity_offset_sigma);
  EXPECT_LT(after.disparity_bend_sigma, 1.5 * before.disparity_bend_sigma);
}

TEST(VisualOdometry, APredictedPairIsAsUncertainAsAVehicleMayAccelerate) {
  for (const int missed : {1, 2}) {
    VisualOdometry odometry(knownRig());
    const OdometryResult before = follow(odometry, 5);
    const OdometryResult predicted = odometry.update(blindPair(5 + missed));
    const double dt = 0.1 * missed, seconds_cubed = 2.0 / 3.0 * std::pow(dt, 3);
    Vector6d variance;
    const MotionPriorOptions options;
    variance << Eigen::Vector3d::Constant(std::pow(options.acceleration, 2) * seconds_cubed),
        Eigen::Vector3d::Constant(std::pow(options.rotation_acceleration, 2) * seconds_cubed);
    // As far off as the velocity before was, and by what a vehicle may accelerate.
    const Matrix6d expected = Matrix6d(variance.asDiagonal()) + missed * missed * before.motion_covariance;
    EXPECT_LT((predicted.motion_covariance - expected).norm(), 1e-12);
    const Matrix6d carried = adjoint(predicted.T_previous_current.inverse());
    EXPECT_LT((predicted.pose_covariance - carried * before.pose_covariance * carried.transpose() - expected).norm(),
              1e-9 * expected.norm());
  }
}

TEST(VisualOdometry, StampsThatMisleadThePriorDoNotMisleadThePose) {
  // 10 and 190 ms apart in turns: the prior is wrong by metres, with or against the way.
  int degraded = 0;
  VisualOdometry odometry({});
  for (int i = 0; i <= 20; ++i) {
    const OdometryResult result = odometry.update(pairStamped(i, i > 5 && i % 2 == 0 ? 90000000 : 0));
    ASSERT_TRUE(result.has_pose) << i << ": " << result.reason;
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), 0.05) << i;
    // A speed of 0.8 m in 10 ms is not believed, the way itself is.
    EXPECT_LT(positionSigma(result), 0.2) << i;
    if (result.state != TrackingState::kDegraded) continue;
    ++degraded;
    EXPECT_GT(std::sqrt(result.motion_covariance(2, 2)), 0.3) << i << ": " << result.reason;
  }
  EXPECT_GE(degraded, 5) << "the stamps are not believed";
}

TEST(VisualOdometry, AKnownDelayBeyondHalfAnIntervalIsNoOtherPairs) {
  VisualOdometryOptions options = knownRig();
  options.calibration.right_delay = 0.055;
  VisualOdometry odometry(options);
  for (int i = 0; i <= 20; ++i) {
    StereoFeatures late = pairOf(i, 0.1);
    const Eigen::Isometry3d motion = drivePose(i).inverse() * drivePose(i + 1);
    const Eigen::Isometry3d T_late_left = expSE3(0.55 * logSE3(motion)).inverse();
    for (int k = 0; k < late.count(); ++k) {
      const Eigen::Vector3d right = late.camera.project(T_late_left * late.point(k));
      late.disparity[k] = std::max(late.u[k] - static_cast<float>(right.z()), 0.01f);
      late.dv[k] += static_cast<float>(right.y()) - late.v[k];
    }
    const OdometryResult result = odometry.update(late);
    EXPECT_TRUE(result.state == TrackingState::kTracking || i < 5) << i << ": " << result.reason;
  }
}

TEST(VisualOdometry, RotationsOfABurstAreMeasured) {
  // Pairs that arrive by threes, stamped a millisecond apart: 0.02 rad each would be 20 rad/s.
  VisualOdometry odometry({});
  for (int i = 0; i <= 20; ++i) {
    const OdometryResult result = odometry.update(pairStamped(i, i < 6 ? 0 : -(i % 3) * (kPeriod - 1000000)));
    ASSERT_TRUE(result.has_pose) << i << ": " << result.reason;
    EXPECT_FALSE(contains(result.reason, "rad/s exceeds")) << result.reason;
    EXPECT_LT(distanceBetween(result.T_origin_camera, trueSinceStart(i)), 0.05) << i;
  }
}

/// Points 60 to 120 m away hardly tell a step from a standstill: there half a pixel is metres.
const synthetic::World& farWorld() {
  static const synthetic::World far = synthetic::randomWorld(31, 2000, {-80.0, -40.0, 60.0}, {80.0, 40.0, 120.0});
  return far;
}

TEST(VisualOdometry, AWayThatTheMapKnowsBadlyIsDoubted) {
  VisualOdometryOptions options;
  options.tracking.doubtful_deviation = 0.005;
  VisualOdometry odometry(options);
  const auto update = [&](int i) {
    const auto seed = 400 + static_cast<unsigned>(i);
    return odometry.update(pairAt(Eigen::Isometry3d::Identity(), i, farWorld(), 0.5, seed, 150.0));
  };
  for (int i = 0; i < 3; ++i) update(i);
  expectState(update(3), TrackingState::kDegraded, "doubtful_deviation");
  options.tracking.doubtful_deviation = 10.0;
  odometry.configure(options);
  expectState(update(4), TrackingState::kTracking);
}

TEST(VisualOdometry, ASimulatedCameraThatStopsDeadIsNotLost) {
  VisualOdometry odometry({});
  const OdometryResult before = follow(odometry, 8);
  constexpr int kStops = 9, kMoves = kStops + 1000;
  double trace = before.pose_covariance.trace();
  OdometryResult result;
  for (int i = kStops; i < kMoves; ++i) {
    result = odometry.update(stampedAs(i, pairOf(8)));
    ASSERT_EQ(result.state, TrackingState::kDegraded) << i;
    ASSERT_TRUE(result.T_origin_camera.isApprox(before.T_origin_camera, 1e-9)) << i;
    ASSERT_GT(result.pose_covariance.trace(), trace) << i;
    ASSERT_GT(result.motion_covariance(4, 4), 0.01 * 0.01) << i << ": it may turn meanwhile";
    if (i < kStops + 6) {
      EXPECT_LT(poseError(result, trueSinceStart(i)), 20.0) << i << ": it may have gone on";
    }
    ASSERT_EQ(result.reason,
              "the images repeat those of the previous pair although the camera moved: is the driver frozen?");
    trace = result.pose_covariance.trace();
  }
  // It moves on slowly.
  for (int i = kMoves; i < kMoves + 6; ++i) {
    Eigen::Isometry3d pose = drivePose(8);
    pose.translation() += 0.05 * (i - kMoves + 1) * pose.linear().col(2);
    result = odometry.update(pairAt(pose, i, street()));
    EXPECT_EQ(result.epoch, before.epoch);
    EXPECT_LT(result.pose_covariance.trace(), 10.0 * before.pose_covariance.trace()) << "the map tells where it is";
    EXPECT_LT(distanceBetween(result.T_origin_camera, drivePose(0).inverse() * pose), 0.01) << i;
  }
  EXPECT_EQ(result.state, TrackingState::kTracking) << result.reason;
}

/// As a simulated camera without noise gives them while it stands. A gyro alone may say that the driver is frozen.
TEST(VisualOdometry, ImagesThatRepeatThemselvesWhileItStandsAreAStandstillUnlessAGyroTurns) {
  VisualOdometry standing({}), turning({});
  MotionGuess guess;
  guess.rotation_only = true;
  for (int i = 0; i <= 12; ++i) {
    const StereoFeatures features = stampedAs(i, pairOf(0));
    EXPECT_EQ(standing.update(features).state, TrackingState::kTracking) << i;
    if (i > 4) guess.T_previous_current.linear() = expSO3({0.0, 0.1, 0.0});  // 57 deg/s
    EXPECT_EQ(turning.update(features, guess).state, i <= 4 ? TrackingState::kTracking : TrackingState::kDegraded) << i;
  }
}

/// A simulated robot that stops within a pair.
TEST(VisualOdometry, ImagesThatRepeatThemselvesAreAStandstillWhereAGuessSaysSo) {
  struct {
    std::optional<MotionGuess> first, second;
    bool frozen_first, frozen_second;
  } const cases[] = {{MotionGuess{}, MotionGuess{}, false, false},
                     {MotionGuess{Eigen::Isometry3d::Identity(), true}, {}, true, true},  // of the turn alone
                     {{}, MotionGuess{}, true, false}};                                   // missed the first of them
  for (const auto& c : cases) {
    VisualOdometry odometry({});
    const OdometryResult before = follow(odometry, 8), first = odometry.update(stampedAs(9, pairOf(8)), c.first);
    EXPECT_EQ(contains(first.reason, "frozen"), c.frozen_first) << first.reason;
    if (!c.frozen_first) {
      EXPECT_LT(distanceBetween(first.T_origin_camera, before.T_origin_camera), 1e-3);
    }
    const OdometryResult second = odometry.update(stampedAs(10, pairOf(8)), c.second);
    EXPECT_EQ(contains(second.reason, "frozen"), c.frozen_second) << second.reason;
  }
}

/// What stands still around a camera, and a swarm of points that moves past it by 0.12 m a pair and is the larger part
/// of the view from pair 6 on.
StereoFeatures crowdedPair(int i) {
  const auto seed = 300 + static_cast<unsigned>(i);
  const synthetic::World still = synthetic::randomWorld(21, 250, {-10.0, -4.0, 5.0}, {10.0, 3.0, 20.0});
  StereoFeatures features = pairAt(Eigen::Isometry3d::Identity(), i, still, 0.1, seed);
  if (i < 6) return features;
  synthetic::World swarm = synthetic::randomWorld(22, 400, {-3.0, -1.5, 3.0}, {3.0, 1.5, 6.0});
  for (Eigen::Vector3d& point : swarm.points) point.x() += 0.12 * (i - 6);
  synthetic::addAll(features, pairAt(Eigen::Isometry3d::Identity(), i, swarm, 0.1, seed));
  return features;
}

TEST(VisualOdometry, DoesNotFollowWhatMovesBeforeAStandingCamera) {
  VisualOdometry odometry({});
  int degraded = 0;
  for (int i = 0; i <= 20; ++i) {
    const OdometryResult result = odometry.update(crowdedPair(i));
    ASSERT_TRUE(result.has_pose) << i << ": " << result.reason;
    EXPECT_LT(result.T_origin_camera.translation().norm(), 0.02) << i << ": " << result.reason;
    if (result.state != TrackingState::kDegraded) continue;
    ++degraded;
    EXPECT_TRUE(contains(result.reason, "two motions")) << result.reason;
    // It may be the others that stand: the difference of 0.12 m is within five standard deviations.
    EXPECT_GT(std::sqrt(result.motion_covariance(0, 0)), 0.12 / 5.0) << i;
  }
  EXPECT_GE(degraded, 10);
}

TEST(VisualOdometry, WhatIsInDoubtTellsNothingOfWhatMayBeExpected) {
  // From pair 6 on only what is far away is to be seen, as if by a camera that goes 0.4 m a pair and not 0.8 m.
  const auto farPair = [&](int i, const Eigen::Isometry3d& pose) {
    return pairAt(pose, i, farWorld(), i > 5 ? 2.0 : 0.5, 700 + static_cast<unsigned>(i), 150.0);
  };
  VisualOdometryOptions options;
  options.tracking.doubtful_deviation = 0.001;
  VisualOdometry odometry(options);
  const auto goSlowly = [&](int i) {
    return odometry.update(farPair(i, drivePose(5) * Eigen::Translation3d(0.0, 0.0, 0.4 * (i - 5))));
  };
  for (int i = 0; i <= 5; ++i) {
    StereoFeatures features = pairOf(i);
    synthetic::addAll(features, farPair(i, drivePose(i)));
    ASSERT_EQ(odometry.update(features).state, TrackingState::kTracking) << i;
  }
  for (int i = 6; i <= 8; ++i) ASSERT_EQ(goSlowly(i).state, TrackingState::kDegraded) << i;
  for (int i = 9; i <= 10; ++i) odometry.update(blindPair(i));
  ASSERT_TRUE(goSlowly(11).has_pose) << "found again, or started";
  const OdometryResult doubtful = goSlowly(12);
  expectState(doubtful, TrackingState::kDegraded);
  EXPECT_NEAR(doubtful.T_previous_current.translation().z(), 0.4, 0.2);
}

/// Some rows of pair i, most of them too high or too low by what the search accepts and the adjustment refutes.
StereoFeatures loosePair(int i) {
  constexpr float kLoose = 6.f;  // px
  std::vector<int> rows;
  for (int row = 0; row < pairOf(i).count(); row += 14) rows.push_back(row);
  StereoFeatures few = pairOf(i).select(rows);
  for (int k = 0; k < few.count(); ++k) few.v[k] += k % 5 == 0 ? 0.f : k % 5 % 2 == 0 ? kLoose : -kLoose;
  return few;
}

TEST(VisualOdometry, WhatTheAdjustmentRefutesLeavesTheMapAsItWas) {
  VisualOdometryOptions options;
  options.motion.min_inliers = 18;
  VisualOdometry odometry(options), blind(options);
  follow(odometry, 8), follow(blind, 8);
  options.noise.corner = 2.0;  // of which exact pairs leave a half; the map keeps its own
  odometry.configure(options), blind.configure(options);
  for (int i = 9; i <= 13; i += 2) {
    expectState(odometry.update(loosePair(i)), TrackingState::kDegraded, "after the adjustment");
    expectState(blind.update(blindPair(i)), TrackingState::kDegraded);
    const OdometryResult next = odometry.update(pairOf(i + 1)), expected = blind.update(pairOf(i + 1));
    EXPECT_EQ(next.epoch, 0);
    EXPECT_TRUE(next.T_origin_camera.isApprox(expected.T_origin_camera, 1e-12));
    EXPECT_EQ(next.inliers, expected.inliers);
  }
}

TEST(VisualOdometry, FlowLeadsFromWhereAFeatureWasToWhereItIs) {
  const auto clearPair = [](int i) { return pairAt(drivePose(i), i, street(), 0.0, 70 + static_cast<unsigned>(i)); };
  VisualOdometry odometry({});
  for (int i = 0; i < 3; ++i) odometry.update(clearPair(i));
  const StereoFeatures before = clearPair(2), now = clearPair(3);
  const OdometryResult result = odometry.update(now);
  int compared = 0;
  for (const FeatureFlow& flow : result.flow) {
    EXPECT_TRUE(flow.inlier);
    for (int row = 0; row < before.count(); ++row) {
      if (!synthetic::equalMats(before.descriptors.row(row), now.descriptors.row(flow.current))) continue;
      EXPECT_NEAR(flow.u_previous, before.u[row], 0.1);
      EXPECT_NEAR(flow.v_previous, before.v[row], 0.1);
      ++compared;
    }
  }
  EXPECT_GT(compared, 50);
}

TEST(VisualOdometry, TakesOtherOptionsOverWhileRunning) {
  VisualOdometry odometry({});
  follow(odometry, 5);
  VisualOdometryOptions options;
  options.tracking.max_gap = -1.0;
  EXPECT_THROW(odometry.configure(options), std::invalid_argument);
  EXPECT_EQ(odometry.options().tracking.max_gap, 1.0);
  options.tracking.max_gap = 1.0, options.tracking.max_predicted_pairs = 0;
  odometry.configure(options);
  EXPECT_EQ(odometry.update(pairOf(6)).state, TrackingState::kTracking) << "the map goes on";
  EXPECT_EQ(odometry.update(blindPair(7)).state, TrackingState::kLost);
  options.motion.min_inliers = 5000;
  odometry.configure(options);
  EXPECT_EQ(odometry.update(pairOf(8)).state, TrackingState::kLost) << "never so many features";
}

/// Of a camera that turns and shakes, after `time` s.
Eigen::Isometry3d shakenPose(double time) {
  Vector6d motion;
  motion << 0.3 * std::sin(2.0 * time), 0.1 * std::sin(9.0 * time), 0.8 * time, 0.03 * std::sin(11.0 * time),
      0.4 * std::sin(1.5 * time), 0.02 * std::sin(13.0 * time);
  return expSE3(motion);
}

constexpr double kShakenSeconds = 0.05;  // between pairs

/// Pair i of that camera; its rows are taken within `readout` s, the middle one at the stamp.
StereoFeatures rolledPair(int i, double readout) {
  const StereoCamera camera = synthetic::camera();
  const synthetic::World& world = street();
  StereoFeatures features =
      synthetic::noFeatures(camera, stampOf(0) + static_cast<std::int64_t>(1e9 * kShakenSeconds * i));
  for (std::size_t k = 0; k < world.points.size(); ++k) {
    double time = kShakenSeconds * i;
    Eigen::Vector3d point;
    for (int iteration = 0; iteration < 10; ++iteration) {
      point = shakenPose(time).inverse() * world.points[k];
      if (point.z() < 2.0) break;
      time = kShakenSeconds * i + readout * ((camera.project(point).y() + 0.5) / camera.height - 0.5);
    }
    if (point.z() < 2.0 || point.z() > 25.0) continue;
    const Eigen::Vector3d pixel = camera.project(point);
    if (camera.sees(pixel) && pixel.z() > 0.0)
      synthetic::addFeature(features, pixel.x(), pixel.y(), pixel.x() - pixel.z(), world.rows[k]);
  }
  return features;
}

TEST(VisualOdometry, ARollingShutterOfKnownReadoutIsAsGoodAsAGlobalOne) {
  constexpr double kReadout = 0.025;
  const auto positions = [](double taken, double known) {
    VisualOdometryOptions options;
    options.calibration.readout = known;
    VisualOdometry odometry(options);
    std::vector<Eigen::Vector3d> path;
    for (int i = 0; i < 40; ++i) {
      const OdometryResult result = odometry.update(rolledPair(i, taken));
      EXPECT_TRUE(result.has_pose) << i << ": " << result.reason;
      path.push_back(result.T_origin_camera.translation());
    }
    return path;
  };
  const auto largest = [truth = positions(0.0, 0.0)](const std::vector<Eigen::Vector3d>& estimate) {
    double error = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) error = std::max(error, (estimate[i] - truth[i]).norm());
    return error;
  };
  const double unknown = largest(positions(kReadout, 0.0)), known = largest(positions(kReadout, kReadout));
  EXPECT_LT(largest(positions(-kReadout, -kReadout)), 0.2 * unknown) << "read upwards";
  EXPECT_LT(known, 0.2 * unknown);
  EXPECT_LT(known, 0.02) << "m, of 1.6 m";
}

TEST(VisualOdometry, AnUnknownReadoutIsFoundAndCompensated) {
  constexpr double kReadout = 0.025;
  constexpr int kPairs = 120, kFound = 80;
  VisualOdometry odometry((VisualOdometryOptions()));
  std::vector<Eigen::Vector3d> path;
  OdometryResult last;
  for (int i = 0; i < kPairs; ++i) {
    last = odometry.update(rolledPair(i, kReadout));
    path.push_back(last.T_origin_camera.translation());
  }
  EXPECT_NEAR(last.readout, kReadout, 2.0 * last.readout_sigma);
  EXPECT_LT(last.readout_sigma, RowReadout::kWarn);
  const auto truth = [](int i) { return Eigen::Vector3d(shakenPose(kShakenSeconds * i).translation()); };
  EXPECT_LT((path.back() - path[kFound] - truth(kPairs - 1) + truth(kFound)).norm(), 0.01) << "m, of 1.6 m";
}

}  // namespace sdvo::test_visual_odometry
