#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../../src/belief/belief.hpp"

namespace sdvo::test_belief {

Doubt after(double log_odds, const std::string& cause) {
  Doubt doubt;
  doubt.raise({{log_odds, cause, true}});
  return doubt;
}

constexpr double kPeriod = 0.1;  // s

TEST(Doubt, FadesByHalves) {
  EXPECT_NEAR(probabilityOf(Doubt().logOdds()), 0.001, 1e-4);
  Doubt doubt = after(kCertain, "a knock");
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.999, 1e-4);
  int doubtful = 0;
  for (; doubt.logOdds() > logOdds(0.05); ++doubtful) doubt.fade(kPeriod);
  EXPECT_EQ(doubtful, 5) << "pairs, at 10 Hz";
  Doubt often = after(kCertain, "a knock"), once = often;
  for (int k = 0; k < 10; ++k) often.fade(0.1 * kPeriod);
  once.fade(kPeriod);
  EXPECT_NEAR(often.logOdds(), once.logOdds(), 1e-9) << "whatever the rate";
  doubt.raise({{50.0, "anything", true}});
  EXPECT_LE(doubt.logOdds(), kCertain);
}

TEST(Doubt, LastsUntilItSaysNothing) {
  EXPECT_FALSE(Doubt().lasts());
  Doubt doubt = after(logOdds(0.05), "a knock");
  EXPECT_TRUE(doubt.lasts());
  int pairs = 0;
  for (; doubt.lasts(); ++pairs) doubt.fade(kPeriod);
  EXPECT_NEAR(probabilityOf(doubt.logOdds()), 0.0015, 0.0005);
  EXPECT_GT(pairs, 4) << "longer than it makes a motion doubtful";
}

/// A motion of 2 m without a prior, and a hundred lasting points, of which so many agree.
class Weighed : public testing::Test {
 protected:
  Belief weigh(Doubt& doubt, int agreeing, const std::vector<Evidence>& evidence = {}) {
    MotionHypothesis found;
    found.motion.T_current_reference.translation().z() = -2.0;
    found.agreement.lasting_matches = 100;
    found.agreement.lasting_inliers = agreeing;
    return doubt.update(scene_, found, evidence);
  }

  LocalMap map_{{}};
  StereoFeatures features_;
  MotionScene scene_{map_, {}, features_};
};

TEST_F(Weighed, WhereNothingIsExpectedTheMotionIsAsUncertainAsItIsLong) {
  MotionHypothesis found;
  found.motion.T_current_reference.translation().z() = -2.0;
  Doubt doubt = after(kCertain, "a knock");
  doubt.raise({{0.0, "less", true}});
  const Belief belief = doubt.update(scene_, found, {});
  EXPECT_EQ(belief.reason.rfind("a moment ago a knock", 0), 0u) << belief.reason;
  EXPECT_NEAR(belief.probability, 0.001, 1e-4);
  EXPECT_NEAR(std::sqrt(belief.moment(2, 2)), 2.0, 0.1);
}

TEST_F(Weighed, AMotionThatNothingSpeaksAgainstIsBelieved) {
  Doubt doubt;
  EXPECT_GT(weigh(doubt, 90).probability, 0.99);
  EXPECT_FALSE(doubt.lasts());
}

/// exp() of log-odds above 709 is infinite, and infinity times a probability of zero is no number.
TEST_F(Weighed, OverwhelmingEvidenceLeavesFiniteNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double log_odds : {6.9, 100.0, 709.0, 710.0, 2000.0, infinity, -infinity, nan}) {
    Doubt doubt;
    const Belief belief = weigh(doubt, 90, {{log_odds, "a knock", true}});
    EXPECT_TRUE(belief.moment.allFinite() && belief.pose_moment.allFinite()) << log_odds;
    EXPECT_EQ(belief.probability<0.1, log_odds> 0.0) << log_odds << ": " << belief.probability;
    EXPECT_LE(doubt.logOdds(), kCertain) << log_odds;
  }
}

TEST_F(Weighed, AMotionOfNoProbabilityLeavesFiniteNumbers) {
  MotionHypothesis found;
  found.probability = 0.0;
  Doubt doubt;
  const Belief belief = doubt.update(scene_, found, {});
  EXPECT_TRUE(belief.moment.allFinite() && belief.pose_moment.allFinite());
  EXPECT_LT(belief.probability, 0.01);
}

/// A weight below zero would make the covariance indefinite.
TEST_F(Weighed, EvidenceForTheMotionTakesNothingFromItsCovariance) {
  Doubt with, without;
  const Belief belief = weigh(with, 90, {{-30.0, "exchanged pairs"}}), plain = weigh(without, 90);
  EXPECT_EQ(belief.moment, plain.moment);
  EXPECT_EQ(belief.probability, plain.probability);
}

TEST_F(Weighed, ALikelierRivalStays) {
  MotionHypothesis found;
  for (int i = 0; i < 100; ++i) {
    found.matches.push_back({i, i, 0.f});
    found.motion.inliers.push_back(i);
  }
  const auto view = std::make_shared<LocalMap::View>();
  view->seen.assign(100, 1);
  found.view = view;
  found.rival = MotionHypothesis::Rival{Eigen::Isometry3d::Identity(), 0.4, {}, true};
  found.replaceMotion(scene_, Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 1.0)), {0, 1, 2, 3, 4});
  ASSERT_TRUE(found.rival);
  EXPECT_TRUE(found.rival->is_torn);
  EXPECT_LT(found.probability, 1.0) << "the other one is still a rival";
}

TEST_F(Weighed, EvidenceMakesThePairDoubtfulWhateverAgrees) {
  Doubt doubt;
  const Belief belief = weigh(doubt, 90, {{kUnsuspected, "nothing"}, {2.0, "a knock"}});
  EXPECT_NEAR(belief.probability, probabilityOf(-2.0), 0.02);
  EXPECT_EQ(belief.reason.rfind("a knock", 0), 0u) << belief.reason;
}

TEST_F(Weighed, LastingPointsTakeADoubtBack) {
  Doubt agreed = after(kCertain, "a knock"), contradicted = agreed;
  agreed.fade(kPeriod), contradicted.fade(kPeriod);
  EXPECT_GT(weigh(agreed, 95).probability, 0.85) << "in the next pair";
  EXPECT_GT(weigh(agreed, 95).probability, 0.99) << "in the one after it";
  const Belief belief = weigh(contradicted, 10);
  EXPECT_LT(belief.probability, 0.01);
  EXPECT_EQ(belief.reason.rfind("a moment ago a knock", 0), 0u) << belief.reason;
}

TEST_F(Weighed, ARefutedDoubtLeavesItsCauseBehind) {
  Doubt doubt = after(kCertain, "a knock");
  doubt.fade(0.5);
  weigh(doubt, 100, {{1.0, "a frozen driver", true}});
  doubt.fade(kPeriod);
  const Belief belief = weigh(doubt, 10);
  EXPECT_EQ(belief.reason.rfind("a moment ago a frozen driver", 0), 0u) << belief.reason;
}

TEST_F(Weighed, CausesExcludeEachOtherAndTheirOddsAddUp) {
  Doubt one, two;
  const double single = weigh(one, 90, {{1.0, "a knock"}}).probability;
  EXPECT_NEAR(weigh(two, 90, {{1.0, "a knock"}, {1.0, "a frozen driver"}}).probability, single / (2.0 - single), 0.01);
}

TEST_F(Weighed, WhatEndsWithThePairLeavesNoDoubt) {
  Doubt doubt;
  weigh(doubt, 90, {{kCertain, "a right image of another pair"}});
  EXPECT_FALSE(doubt.lasts());
}

TEST_F(Weighed, TheErrorsOfADoubtThatLastsAddUp) {
  Doubt doubt;
  const Belief first = weigh(doubt, 10, {{kCertain, "a knock", true}});
  doubt.fade(kPeriod);
  const Belief second = weigh(doubt, 10, {{kCertain, "a knock", true}});
  EXPECT_NEAR(second.moment(2, 2), first.moment(2, 2), 0.01);
  EXPECT_NEAR(second.pose_moment(2, 2), 4.0 * first.pose_moment(2, 2), 0.1) << "both motions may be wrong alike";
}

TEST(MotionMixture, WeighsAlternativesHoweverLikelyOneIs) {
  MotionMixture mixture;
  EXPECT_EQ(mixture.probability(), 1.0);
  EXPECT_TRUE(mixture.moment().isZero() && mixture.cause().empty());
  mixture.add({std::log(0.5), Matrix6d::Identity(), "a mover"});
  mixture.add({std::log(1.5), 4.0 * Matrix6d::Identity(), "a knock"});
  EXPECT_NEAR(mixture.probability(), 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(mixture.moment()(2, 2), (0.5 + 6.0) / 3.0, 1e-12);
  EXPECT_EQ(mixture.cause(), "a knock");
  mixture.add({1e4, 9.0 * Matrix6d::Identity(), "another pair"});
  EXPECT_EQ(mixture.probability(), 0.0);
  EXPECT_NEAR(mixture.moment()(2, 2), 9.0, 1e-12);
}

}  // namespace sdvo::test_belief
