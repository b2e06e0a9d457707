#include <gtest/gtest.h>

#include "../../src/belief/motion_hypotheses.hpp"
#include "../synthetic_scene.hpp"

namespace sdvo::test_motion_hypotheses {

Eigen::Isometry3d moved(double x) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, 0.0, 0.0));
}

/// A pair that matches some points of the world, on the left, and some of a thing that moved by x on the right.
class Competition : public ::testing::Test {
 protected:
  void add(int count, double x, int sightings, double depth = 6.0) {
    std::mt19937 random(static_cast<unsigned>(view_->seen.size()));
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < count; ++i) {
      const double z = depth + 2.0 * uniform(random), side = (x == 0.0 ? -0.5 : 0.5) + 0.45 * uniform(random);
      insert({0.5 * side * z, 2.0 * uniform(random), z}, x, sightings);
    }
  }

  void insert(const Eigen::Vector3d& point, double x, int sightings) {
    const int index = static_cast<int>(view_->seen.size());
    all_.matches.push_back({index, index, 0.f});
    all_.correspondences.push_back({point, synthetic::camera().project(moved(x) * point)});
    view_->seen.push_back(sightings);
  }

  /// Of the whole width, above or below the image's middle row.
  void addRows(int count, double x, int sightings, bool above) {
    std::mt19937 random(static_cast<unsigned>(view_->seen.size()));
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int i = 0; i < count; ++i) {
      const double z = 4.0 + 4.0 * uniform(random), y = 0.2 * (0.1 + uniform(random));
      insert({(uniform(random) - 0.5) * z, (above ? -y : y) * z, z}, x, sightings);
    }
  }

  /// The hypothesis that the camera moved so.
  MotionHypothesis hypothesis(double x) const {
    MotionHypothesis found = all_;
    found.view = view_;
    found.gate = 20.0;
    found.motion.success = true;
    found.motion.T_current_reference = moved(x);
    found.motion.covariance = 1e-6 * Matrix6d::Identity();
    found.motion.inliers = PoseProblem(synthetic::camera(), found.correspondences, kThreshold).inliers(moved(x));
    found.countAgreement();
    for (const ExpectedMotion& expected : scene_.prior)
      found.innovation = expected.normalisedSquare(moved(x).inverse(), found.motion.covariance);
    return found;
  }

  MotionHypothesis choose(std::vector<double> motions) const {
    std::vector<MotionHypothesis> hypotheses;
    for (const double x : motions) hypotheses.push_back(hypothesis(x));
    return chooseMotion(scene_, kThreshold, hypotheses);
  }

  static constexpr double kThreshold = 3.0;  // px
  std::shared_ptr<LocalMap::View> view_ = std::make_shared<LocalMap::View>();
  MotionHypothesis all_;
  LocalMap map_{LocalMapOptions()};
  StereoFeatures features_ = synthetic::noFeatures(synthetic::camera());
  MotionScene scene_{map_, {}, features_};
};

TEST(BayesFactor, IsTheRatioOfTheTwoDensities) {
  // Of independent numbers: N(x; 0, s + p) / N(x; 0, s).
  Vector6d measured, information, covariance;
  measured << 0.1, 0.0, -0.2, 0.3, 0.0, 0.01;
  information << 1e2, 1e4, 1e3, 50.0, 1e5, 1e6;
  covariance << 0.01, 0.04, 1e-3, 0.0, 2e-3, 0.5;
  double expected = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double noise = 1.0 / information[i], both = noise + covariance[i], square = measured[i] * measured[i];
    expected += 0.5 * (square / noise - square / both + std::log(noise / both));
  }
  EXPECT_NEAR(logBayesFactor<6>(measured, information.asDiagonal(), covariance.asDiagonal()), expected, 1e-9);
  // The same in other axes.
  const Matrix6d axes = adjoint(Eigen::Isometry3d(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, 3.0).normalized())));
  const Matrix6d P = axes * covariance.asDiagonal() * axes.transpose();
  const Matrix6d H = axes * information.asDiagonal() * axes.transpose();
  EXPECT_NEAR(logBayesFactor<6>(axes * measured, H, P), expected, 1e-6);
}

TEST_F(Competition, LastingPointsOutweighAMajorityOfNewOnes) {
  add(100, 0.0, 4), add(200, 0.5, 1);
  const MotionHypothesis found = choose({0.5, 0.0});
  EXPECT_NEAR(found.motion.T_current_reference.translation().x(), 0.0, 1e-12);
  ASSERT_TRUE(found.rival);
  EXPECT_EQ(found.rival->features.size(), 200U);
  EXPECT_NEAR(found.rival->probability + found.probability, 1.0, 1e-12);
  EXPECT_EQ(found.agreement.matches, 100) << "matches of a rival speak against nothing";
}

TEST_F(Competition, ProbabilitiesFollowTheShareAndNotTheNumber) {
  // Ten times the points are not ten times the evidence: they are the same two things.
  add(60, 0.0, 4), add(40, 0.5, 4);
  const MotionHypothesis found = choose({0.0, 0.5});
  const double few = found.probability;
  EXPECT_LT(few, 0.95);
  EXPECT_GT(few, 0.6);
  EXPECT_NEAR(found.rivals_moment(0, 0), (1.0 - few) * 0.25, 1e-9) << "that of the mixture";
  add(540, 0.0, 4), add(360, 0.5, 4);
  EXPECT_NEAR(choose({0.0, 0.5}).probability, few, 0.01);
}

TEST_F(Competition, WhereARowDividesTwoMotionsTheShareIsNoEvidence) {
  addRows(40, 0.0, 4, true), addRows(80, 0.5, 4, false);
  const MotionHypothesis found = choose({0.0, 0.5});
  ASSERT_TRUE(found.rival);
  EXPECT_TRUE(found.rival->is_torn);
  EXPECT_LT(found.probability, 0.7);
  // The prior tells which part is the camera's.
  scene_.prior = {{moved(0.0), 0.01 * Matrix6d::Identity()}};
  const MotionHypothesis expected = choose({0.0, 0.5});
  EXPECT_NEAR(expected.motion.T_current_reference.translation().x(), 0.0, 1e-12);
  EXPECT_GT(expected.probability, 0.99);
}

TEST_F(Competition, OnlyARowThatDividesGoodAndLastingPartsIsATornImage) {
  struct Case {
    const char* why;
    bool by_rows;
    int still, moved, moved_sightings;
    double x, least;  ///< the motion that stands and how probable it is
  };
  for (const Case& c :
       {Case{"new points below a row are rather a board", true, 60, 60, 0, 0.0, 0.8},
        Case{"a column between two motions", false, 40, 80, 4, 0.5, 0.8},
        Case{"what is no good part of the view may lie above a row by chance", true, 5, 80, 4, 0.5, 0.95}}) {
    SCOPED_TRACE(c.why);
    view_ = std::make_shared<LocalMap::View>();
    all_ = {};
    if (c.by_rows)
      addRows(c.still, 0.0, 4, true), addRows(c.moved, 0.5, c.moved_sightings, false);
    else
      add(c.still, 0.0, 4), add(c.moved, 0.5, c.moved_sightings);
    const MotionHypothesis found = choose({0.0, 0.5});
    EXPECT_NEAR(found.motion.T_current_reference.translation().x(), c.x, 1e-12);
    EXPECT_GT(found.probability, c.least);
    EXPECT_TRUE(c.by_rows || !found.rival->is_torn);
  }
}

TEST_F(Competition, WithoutARivalTheMotionIsCertain) {
  add(100, 0.0, 4);
  const MotionHypothesis found = choose({0.0, 0.001});
  EXPECT_EQ(found.probability, 1.0);
  EXPECT_FALSE(found.rival);
  EXPECT_TRUE(found.rivals_moment.isZero());
  add(2, 0.5, 4);
  EXPECT_FALSE(choose({0.0, 0.5}).rival) << "by chance";
}

TEST_F(Competition, WhatBothExplainIsNoEvidence) {
  add(100, 0.0, 4), add(20, 0.5, 4);
  const double near_alone = choose({0.0, 0.5}).probability;
  // Half a metre moves points 1000 m away by less than an inlier may be off.
  add(1000, 0.0, 1, 1000.0);
  EXPECT_NEAR(choose({0.0, 0.5}).probability, near_alone, 0.01);
}

TEST_F(Competition, EqualHypothesesAreDecidedByThePrior) {
  add(100, 0.0, 1), add(100, 0.5, 1);
  scene_.prior = {{moved(0.0), 0.01 * Matrix6d::Identity()}};
  EXPECT_NEAR(choose({0.5, 0.0}).motion.T_current_reference.translation().x(), 0.0, 1e-12);
  scene_.prior = {{moved(-0.5), 0.01 * Matrix6d::Identity()}};
  EXPECT_NEAR(choose({0.0, 0.5}).motion.T_current_reference.translation().x(), 0.5, 1e-12);
}

TEST_F(Competition, MotionsWithinToleranceAreNoDoubtButWidenTheCovariance) {
  add(60, 0.0, 4), add(40, 0.06, 4);
  scene_.tolerance = 0.1;
  const MotionHypothesis found = choose({0.0, 0.06});
  EXPECT_EQ(found.probability, 1.0);
  EXPECT_GT(found.rivals_moment(0, 0), 0.0);
  scene_.tolerance = 0.05;
  EXPECT_LT(choose({0.0, 0.06}).probability, 0.95);
}

TEST_F(Competition, OfFailuresTheLargestIsReturned) {
  add(30, 0.0, 1);
  MotionHypothesis small = hypothesis(5.0), large = hypothesis(0.0);
  small.motion.success = large.motion.success = false;
  large.motion.reason = "the largest";
  EXPECT_EQ(chooseMotion(scene_, kThreshold, {small, large}).motion.reason, "the largest");
}

TEST_F(Competition, AnImprobableMotionMisleadsUnlessLastingPointsConfirmIt) {
  scene_.prior = {{moved(2.0), 0.01 * Matrix6d::Identity()}};
  add(100, 0.0, 1);
  EXPECT_GT(logOddsWrong(hypothesis(0.0)), 0.0);
  view_->seen.assign(100, 4);
  EXPECT_LT(logOddsWrong(hypothesis(0.0)), logOdds(0.05));
  scene_.prior.clear();
  EXPECT_LT(logOddsWrong(hypothesis(0.0)), kUnsuspected);
}

TEST_F(Competition, LastingPointsThatDisagreeAreMoreSuspiciousThanUsual) {
  add(25, 0.0, 4), add(75, 0.5, 4);
  EXPECT_GT(logOddsWrong(hypothesis(0.0)), kUnsuspected + 2.0);
}

TEST_F(Competition, RejectedRowsAreNoInliers) {
  add(10, 0.0, 4), add(10, 0.0, 1);
  MotionHypothesis found = hypothesis(0.0);
  EXPECT_EQ(found.agreement.lasting_matches, 10);
  found.countInliers({3, 12});
  EXPECT_EQ(found.agreement.inliers, 18);
  EXPECT_EQ(found.agreement.lasting_inliers, 9);
  EXPECT_EQ(found.inlierFeatures({3, 12}).size(), 18u);
}

TEST(FalseAlarms, AreThoseOfRandomMatches) {
  // Matches anywhere within the gate: how many agree with the best of all motions through three of them?
  EXPECT_LT(logFalseAlarms(50, 20, chanceOfAgreement(3.0, 20.0)), std::log(kTailProbability));
  EXPECT_GT(logFalseAlarms(300, 12, chanceOfAgreement(3.0, 20.0)), 0.0);
  EXPECT_LT(logFalseAlarms(300, 12, chanceOfAgreement(3.0, 200.0)), std::log(kTailProbability))
      << "anywhere in the image less is needed";
  EXPECT_GE(logFalseAlarms(4, 3, 0.01), 0.0) << "three points determine a motion";
}

TEST(SameMotion, ProjectsToTheSamePixels) {
  std::vector<Correspondence> correspondences;
  std::vector<int> all;
  for (int i = 0; i < 100; ++i) {
    correspondences.push_back({{0.02 * i - 1.0, 0.5, 8.0}, Eigen::Vector3d::Zero()});
    all.push_back(i);
  }
  // 400 px * 0.01 m / 8 m are half a pixel in both views, 0.05 m are 2.5 px.
  EXPECT_TRUE(agree(synthetic::camera(), correspondences, all, moved(0.0), moved(0.01), 1.0));
  EXPECT_FALSE(agree(synthetic::camera(), correspondences, all, moved(0.0), moved(0.05), 1.0));
}

TEST(Coverage, CountsCellsOfEightColumnsAndFourRows) {
  StereoFeatures features = synthetic::noFeatures(synthetic::camera());
  for (const auto& [u, v] : {std::pair(10.0, 10.0), {70.0, 110.0}, {85.0, 10.0}, {630.0, 470.0}})
    synthetic::addFeature(features, u, v, 5.0, std::vector<std::uint8_t>(128, 0));
  EXPECT_EQ(coverage(features, {0, 1}), 1.0 / 32.0);
  EXPECT_EQ(coverage(features, {0, 1, 2, 3}), 3.0 / 32.0);
  EXPECT_EQ(coverage(features, {}), 0.0);
  features.u[0] = 1e20f, features.v[0] = 10.f;
  features.u[1] = 630.f, features.v[1] = 10.f;
  EXPECT_EQ(coverage(features, {0, 1}), 1.0 / 32.0) << "far outside on the right";
}

}  // namespace sdvo::test_motion_hypotheses
