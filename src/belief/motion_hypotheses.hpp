#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../map/reacquisition.hpp"
#include "stereo_descriptor_vo/belief/motion_prior.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/motion/motion_estimator.hpp"
#include "stereo_descriptor_vo/motion/noise.hpp"

namespace sdvo {

/// How many matches agree with a motion. Lasting ones are of points that four confirmed pairs saw.
struct Agreement {
  int matches = 0, inliers = 0;
  int lasting_matches = 0, lasting_inliers = 0;
  int sightings = 0, inlier_sightings = 0;  ///< confirmed ones of their points, four at most for each
};

/// Log-odds of being misled, that is of following another motion than the camera's. Of a pair that nothing contradicts
/// (probability of 0.001, chosen), and of an event that leaves a wrong map or a wrong rig.
constexpr double kUnsuspected = -6.9, kCertain = -kUnsuspected;

/// Probabilities as log-odds: log(p / (1 - p)).
double logOdds(double probability);
double probabilityOf(double log_odds);

/// Posterior of where in the map a pair is, after an outage.
struct PlaceBelief {
  Eigen::Isometry3d T_current_newest;  ///< of the likeliest place
  Matrix6d moment;                     ///< second moment of its error, m and rad
  std::string reason;                  ///< in words, what else it may be
};

/// Places that look alike are a mixture. So is the motion of a camera that went on as before (`prior`), if this place
/// looks alike by chance.
PlaceBelief weigh(const FoundPlace& place, const std::vector<ExpectedMotion>& prior);

/// The input of a search for a pair's motion. The references must outlive it.
struct MotionScene {
  const LocalMap& map;
  RigCalibration calibration;
  const StereoFeatures& features;
  std::optional<Eigen::Isometry3d> T_current_reference;  ///< as predicted, since the map's newest pair
  std::optional<Eigen::Isometry3d> guess;                ///< the same as something else than images has it
  std::vector<ExpectedMotion> prior;  ///< of T_reference_current: a mixture; without any, all motions are as likely
  double usual_agreement = 0.9;       ///< ratio of lasting matches that agree with the camera's motion on this rig
  bool is_suspected = false;          ///< what is followed may not be the camera's motion by the pairs before
  bool is_doubted = false;            ///< … and likely is not
  double tolerance = 0.05;            ///< m: motions that differ by less than this and 3 % are equally good
  Noise noise{NoiseOptions()};
  std::optional<PlaceBelief> place{};  ///< of a pair that an outage's map shows
};

/// A motion that competes for being the camera's, and what speaks for it.
struct MotionHypothesis {
  MotionEstimate motion;                       ///< since the map's newest pair
  std::shared_ptr<const LocalMap::View> view;  ///< of the map; one for all hypotheses of a pair
  std::vector<FeatureMatch> matches;           ///< indices of the view to those of the pair's features
  std::vector<Correspondence> correspondences;
  std::vector<LocalMap::Sighting> sightings;   ///< of the motion's inliers
  double gate = 0.0;                           ///< px: how far from their prediction matches may be
  double match_time = 0.0, motion_time = 0.0;  ///< s

  Agreement agreement;       ///< without the matches that rivals explain
  double innovation = 0.0;   ///< square from the prior, in standard deviations; zero without prior
  double probability = 1.0;  ///< among all hypotheses, of the camera's motion being within tolerance of this one
  /// The likeliest motion beyond tolerance.
  struct Rival {
    Eigen::Isometry3d T_current_reference;
    double probability;
    int matches;   ///< that it alone explains
    bool is_torn;  ///< a row of the image divides them from the motion's own
  };
  std::optional<Rival> rival;
  Matrix6d rivals_moment = Matrix6d::Zero();  ///< second moment of the rivals around the motion, m and rad.
  /// Between the motion of the lasting inliers and that of all, if it is taken for noise: the square in standard
  /// deviations of points that err independently.
  std::optional<double> lasting_square;

  /// Of a match: confirmed sightings of its point, four at most.
  int sightingsOf(int match) const;
  bool isLasting(int match) const { return sightingsOf(match) >= kLastingSightings; }

  /// Features of the pair that the inliers matched, but for the rejected ones.
  std::vector<int> inlierFeatures(const std::vector<int>& rejected = {}) const;

  /// Of all matches and of the motion's inliers.
  void countAgreement();
  /// The motion is this one, which leaves some of the inliers, by their features, to the one that was found.
  void replaceMotion(const MotionScene& scene, const Eigen::Isometry3d& T_current_reference,
                     const std::vector<int>& left);
  /// Counts the inliers without these features of the pair.
  void reject(const std::vector<int>& features);

  static constexpr int kLastingSightings = 4;
};

/// Ratio of all points (chosen) above which a part of them is no matter of chance.
constexpr double kGoodPart = 0.1;

/// Ratio of a motion by which it may be off.
constexpr double kTolerableRatio = 0.03;

/// Whether a motion would do as well as another one that is so far `apart`.
bool isTolerable(const MotionScene& scene, const Eigen::Isometry3d& motion, const Eigen::Isometry3d& apart);

/// Logarithm of the Bayes factor (Kass and Raftery 1995) between a difference that has this covariance and none at all,
/// by a measurement of it with that information.
template <int N>
double logBayesFactor(const Eigen::Matrix<double, N, 1>& measured, const Eigen::Matrix<double, N, N>& information,
                      const Eigen::Matrix<double, N, N>& covariance) {
  // With A = I + H P the measurement's variance is H^-1 + P = A^T H^-1, so its inverse is H A^-T = A^-1 H.
  using Square = Eigen::Matrix<double, N, N>;
  const Eigen::PartialPivLU<Square> factor(Square::Identity() + information * covariance);
  const Eigen::Matrix<double, N, 1> weighted = information * measured;
  return 0.5 * (measured.dot(weighted) - measured.dot(factor.solve(weighted)) - std::log(factor.determinant()));
}

/// Logarithm of the number of false alarms (a contrario, Moisan and Stival 2004): the expected number of motions with
/// as many inliers, if each match agrees by `chance`.
double logFalseAlarms(int matches, int inliers, double chance);

/// Chance that a wrong match, anywhere within `gate` px of its prediction, is within `threshold` px of a motion.
double chanceOfAgreement(double threshold, double gate);

/// Whether two motions T_current_reference mean the same: they project most of the given points within so many px.
bool agree(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
           const std::vector<int>& points, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double within);

/// Logarithm of the likelihood, up to a constant, of a motion that leaves some of the `points` to other motions.
/// `of_others`: the sum of their confirmed sightings. Points are no independent witnesses, because what
/// moves has many of them: the sum is tempered by their effective number.
double logLikelihood(double of_others, int points);

/// Logarithm of how many times likelier the agreement of lasting points is with the camera's motion than with that of
/// something that moves.
double logAgreement(const MotionScene& scene, const MotionHypothesis& hypothesis);

/// Log-odds that a motion is not the camera's, by the pair itself: the prior against the agreement of lasting points.
double logOddsMisled(const MotionScene& scene, const MotionHypothesis& hypothesis);

/// Weighs all hypotheses by prior and likelihood, merges those of one motion and takes the likeliest. The one that is
/// returned has the rivals and the times of all. `threshold`, px, of an inlier.
MotionHypothesis chooseMotion(const MotionScene& scene, double threshold, std::vector<MotionHypothesis> hypotheses);

/// Ratio of an 8x4 grid's cells over the image that hold one of these features.
double coverage(const StereoFeatures& features, const std::vector<int>& indices);

}  // namespace sdvo
