#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../src/belief/motion_prior.hpp"
#include "../comma_locale.hpp"
#include "../said.hpp"

namespace sdvo::test_motion_prior {

constexpr std::int64_t kSecond = 1000000000;  // ns

Eigen::Isometry3d ahead(double distance, double angle = 0.0) {
  Vector6d motion = Vector6d::Zero();
  motion[2] = distance, motion[4] = angle;
  return expSE3(motion);
}

MotionPriorOptions withoutStampErrors() {
  MotionPriorOptions options;
  options.stamp_sigma = 0.0;
  return options;
}

/// After 0.1 s at 3 m/s, up to the second second.
MotionPrior moving(const MotionPriorOptions& options, const Matrix6d& covariance = Matrix6d::Zero()) {
  MotionPrior prior(options);
  prior.takeVelocity(kSecond, ahead(0.3), 0.1, covariance, true, Matrix6d::Zero());
  return prior;
}

TEST(MotionPrior, PredictsTheLastVelocity) {
  EXPECT_FALSE(MotionPrior({}).velocity());
  const ExpectedMotion predicted = moving({}, 1e-4 * Matrix6d::Identity()).predicted(0.2);
  EXPECT_NEAR(predicted.motion.translation().z(), 0.6, 1e-12);
  // The velocity is known to 0.01 m in 0.1 s.
  EXPECT_NEAR(predicted.covariance(2, 2) - moving({}).predicted(0.2).covariance(2, 2), 4.0 * 1e-4, 1e-12);
}

TEST(MotionPrior, IsAsWideAsWhiteAccelerationMakesIt) {
  // Simulated: velocities of a random walk, and the mean ones of two neighbouring intervals.
  const MotionPriorOptions options = withoutStampErrors();
  constexpr double kInterval = 0.1;  // s
  constexpr int kSteps = 100, kTrials = 4000;
  std::mt19937 random(5);
  std::normal_distribution<double> change(0.0, options.acceleration * std::sqrt(kInterval / kSteps));
  double square = 0.0, square_after_a_second = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    double velocity = 3.0, first = 0.0, second = 0.0, later = 0.0;
    for (int i = 0; i < 12 * kSteps; ++i) {
      velocity += change(random);
      const double way = velocity * kInterval / kSteps;
      (i < kSteps ? first : i < 2 * kSteps ? second : later) += i < 2 * kSteps || i >= 11 * kSteps ? way : 0.0;
    }
    square += std::pow(second - first, 2) / kTrials;
    square_after_a_second += std::pow(later - first, 2) / kTrials;
  }
  const MotionPrior prior = moving(options);
  EXPECT_NEAR(prior.predicted(kInterval).covariance(2, 2) / square, 1.0, 0.1);
  EXPECT_NEAR(prior.priorByConfirmed(kSecond, kInterval)->covariance(2, 2) / square, 1.0, 0.1);
  EXPECT_NEAR(prior.priorByConfirmed(2 * kSecond, kInterval)->covariance(2, 2) / square_after_a_second, 1.0, 0.1);
}

TEST(MotionPrior, StampsMakeTheWayUncertainNotTheSides) {
  MotionPriorOptions options;
  options.stamp_sigma = 0.02;
  const Matrix6d with = moving(options).priorByConfirmed(kSecond, 0.1)->covariance;
  EXPECT_GT(std::sqrt(with(2, 2)), 3.0 * 0.02 * std::sqrt(2.0)) << "the ends of an interval err apart";
  EXPECT_LT(with(0, 0), 0.5 * with(2, 2));
}

TEST(MotionPrior, APredictionWithinABurstIsAsUncertainAsTheIntervalBefore) {
  MotionPrior prior = moving({});
  for (int i = 0; i < 10; ++i) prior.noteInterval(0.1);
  prior.noteInterval(0.001);
  EXPECT_GT(std::sqrt(prior.predicted(0.001).covariance(2, 2)), 3.0 * 0.079);
  for (int i = 0; i < 100; ++i) prior.noteInterval(0.001);
  EXPECT_LT(std::sqrt(prior.predicted(0.001).covariance(2, 2)), 1e-3);
}

TEST(MotionPrior, AVelocityOverABurstIsThatOverTheLongestIntervalBefore) {
  MotionPrior prior{TrackingOptions()};
  for (int i = 0; i < 10; ++i) prior.noteInterval(0.03);
  prior.takeVelocity(1'000'000, ahead(0.03), 0.001, Matrix6d::Zero(), true, Matrix6d::Zero());
  EXPECT_NEAR(prior.velocity()->z(), 1.0, 1e-9);
}

/// Another nodelet may have set it.
TEST(MotionPrior, WordsDoNotFollowTheLocale) {
  const CommaLocale set;
  EXPECT_EQ(MotionPrior(TrackingOptions()).tooFast(ahead(1234.5), Matrix6d::Zero(), 0.1),
            "a speed of 12345.0 m/s exceeds tracking/max_speed");
}

TEST(MotionPrior, AnIntervalAfterAHiccupIsNoBurst) {
  MotionPrior prior({});
  for (int i = 0; i < 10; ++i) prior.noteInterval(0.033);
  prior.noteInterval(0.9);
  EXPECT_EQ(prior.interval(0.033, ahead(0.1)), 0.033);
}

TEST(MotionPrior, NothingTakesPlaceInLessTimeThanItMayTake) {
  const MotionPriorOptions options;
  const Eigen::Isometry3d turn(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(MotionPrior(options).interval(1e-6, ahead(0.3)), 0.3 / options.max_speed);
  EXPECT_NEAR(MotionPrior(options).interval(1e-6, turn), 0.1 / options.max_rotation_rate, 1e-12);
  EXPECT_EQ(MotionPrior(options).interval(0.1, turn), 0.1);
}

TEST(MotionPrior, AMeanOverALongIntervalIsNoVelocityOfNow) {
  const MotionPriorOptions options = withoutStampErrors();
  MotionPrior prior(options);
  prior.takeVelocity(kSecond, ahead(9.0), 3.0, Matrix6d::Zero(), true, Matrix6d::Zero());
  // Of a random walk: its value at the end differs from the mean by a third of the variance over the 3 s.
  const double least = std::pow(options.acceleration, 2) * 3.0 / 3.0 * 0.1 * 0.1;
  for (const double variance :
       {prior.priorByConfirmed(kSecond, 0.1)->covariance(2, 2), prior.predicted(0.1).covariance(2, 2)}) {
    EXPECT_GT(variance, least);
    EXPECT_LT(variance, 2.1 * least);
  }
}

TEST(MotionPrior, ADoubtfulMotionPredictsAndConfirmsNothing) {
  MotionPrior prior = moving({});
  prior.takeVelocity(2 * kSecond, ahead(0.9), 0.1, Matrix6d::Zero(), false, Matrix6d::Identity());
  EXPECT_NEAR((*prior.velocity())[2], 9.0, 1e-12);
  EXPECT_GT(prior.predicted(0.1).covariance(2, 2), 1.0);
  EXPECT_NEAR(prior.priorByConfirmed(2 * kSecond, 0.1)->motion.translation().z(), 0.3, 1e-12);
  prior.interrupt();
  EXPECT_FALSE(prior.velocity());
  EXPECT_TRUE(prior.priorByConfirmed(2 * kSecond, 0.1));
}

TEST(MotionPrior, APairThatGoesBackAfterOneThatWentTwiceAsFarChangedPlacesWithIt) {
  constexpr double kStep = 0.1, kBack = -0.09;  // s; m, what a walker goes meanwhile
  MotionPrior prior({});
  EXPECT_EQ(prior.logRatioOfSwap(ahead(kBack), kStep), 0.0);
  prior.takeVelocity(kSecond, ahead(0.09), kStep, Matrix6d::Zero(), true, Matrix6d::Zero());
  prior.takeVelocity(kSecond + kSecond / 10, ahead(0.18), kStep, Matrix6d::Zero(), true, Matrix6d::Zero());
  EXPECT_GT(prior.logRatioOfSwap(ahead(kBack), kStep), 6.9) << "a thousand times as likely";
  EXPECT_LT(prior.logRatioOfSwap(ahead(0.18), kStep), 0.0) << "it became faster";
  EXPECT_LT(prior.logRatioOfSwap(ahead(0.09), kStep), 0.0);
  MotionPrior vague = moving({});
  for (const double distance : {0.09, 0.18})
    vague.takeVelocity(kSecond, ahead(distance), kStep, 0.2 * 0.2 * Matrix6d::Identity(), true, Matrix6d::Zero());
  EXPECT_LT(vague.logRatioOfSwap(ahead(kBack), kStep), 2.0) << "motions of few features jump to and fro as well";
}

TEST(MotionPrior, ATurnThatIsReversedIsNoSwap) {
  MotionPrior prior({});
  for (int i = 0; i < 2; ++i)
    prior.takeVelocity((1 + i) * kSecond, ahead(0.0, 0.2), 0.1, Matrix6d::Zero(), true, Matrix6d::Zero());
  EXPECT_LT(prior.logRatioOfSwap(ahead(0.0, -0.2), 0.1), 0.0) << "both would be beyond what a camera does";
}

TEST(MotionPrior, InnovationsAreSquaredInStandardDeviations) {
  ExpectedMotion expected{ahead(0.3), 0.04 * Matrix6d::Identity()};
  EXPECT_NEAR(expected.normalisedSquare(ahead(0.9), Matrix6d::Zero()), 9.0, 1e-9);
  EXPECT_NEAR(expected.normalisedSquare(ahead(0.3, 0.2), 0.04 * Matrix6d::Identity()), 0.5, 0.02)
      << "a turn counts as well, and what the motion itself is uncertain by";
}

TEST(MotionPrior, AnUnseenMotionIsBoundedByTheSpeedAndByATurn) {
  MotionPrior prior = moving({});
  const double second = std::sqrt(prior.outageCovariance(1.0)(0, 0));
  EXPECT_GT(second, 3.0);
  EXPECT_LT(second, 3.5);
  EXPECT_LE(std::sqrt(prior.outageCovariance(1e5)(0, 0)), 70.0 * 1e5);
  EXPECT_LE(std::sqrt(prior.outageCovariance(1e5)(3, 3)), M_PI);
  for (double t = 0.1; t < 100.0; t *= 2.0)
    EXPECT_GT(prior.outageCovariance(2.0 * t)(0, 0), prior.outageCovariance(t)(0, 0));
}

TEST(MotionPrior, NoiseAndStampsMayExceedTheLargestSpeed) {
  const MotionPrior prior({});
  EXPECT_EQ(prior.tooFast(ahead(7.0), Matrix6d::Zero(), 0.1), "");
  EXPECT_TRUE(contains(prior.tooFast(ahead(12.0), Matrix6d::Zero(), 0.1), "max_speed"));
  EXPECT_EQ(prior.tooFast(ahead(12.0), Matrix6d::Identity(), 0.1), "");
  EXPECT_TRUE(contains(prior.tooFast(ahead(0.0, 1.2), Matrix6d::Zero(), 0.1), "rad/s exceeds 6.3 rad/s"));
  EXPECT_EQ(prior.tooFast(ahead(0.01, 0.01), Matrix6d::Zero(), 0.001), "") << "stamps of a burst";
}

}  // namespace sdvo::test_motion_prior
