#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "../map/local_map.hpp"
#include "../map/reacquisition.hpp"
#include "../motion/motion_estimator.hpp"
#include "../motion/noise.hpp"
#include "motion_mixture.hpp"
#include "motion_prior.hpp"
#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// Number of matches that agree with a motion. Lasting ones are of points that four confirmed pairs saw.
struct Agreement {
  int matches = 0, inliers = 0;
  int lasting_matches = 0, lasting_inliers = 0;
  int sightings = 0, inlier_sightings = 0;  ///< confirmed sightings of their points, each four at most
};

/// kUnsuspected: log-odds that a motion is not the camera's, without any evidence (probability of 0.001, chosen).
/// kCertain: bound of evidence and doubt (0.999), as nothing is more certain than the model behind it.
constexpr double kUnsuspected = -6.9, kCertain = -kUnsuspected;

/// Probabilities as log-odds: log(p / (1 - p)).
double logOdds(double probability);
double probabilityOf(double log_odds);

/// The pair's pose in the map, after an outage.
struct PlaceBelief {
  Eigen::Isometry3d T_current_newest;  ///< motion to the likeliest place
  MotionMixture mixture;
};

/// Chooses between the place and the one that looks alike, by the `prior` of the motion. The other place stays an
/// alternative; so does the prior's motion, in case that the map matches by chance.
PlaceBelief choosePlace(const FoundPlace& place, const std::vector<ExpectedMotion>& prior);

/// The input of a search for a pair's motion. The references must outlive it.
struct MotionScene {
  const LocalMap& map;
  RigCalibration calibration;
  const StereoFeatures& features;
  bool all_compete = false;    ///< an earlier doubt lasts: all hypotheses compete
  bool searches_wide = false;  ///< the doubt makes pairs doubtful: search at once in the wide radius
  double tolerance = 0.05;     ///< m: motions that differ by less than this and 3 % are equally good
  Noise noise{NoiseOptions()};
  std::optional<Eigen::Isometry3d> T_current_reference{};  ///< predicted, or the place's; reference: the newest pair
  std::optional<Eigen::Isometry3d> guess{};                ///< the same from another source than images
  /// Mixture for T_reference_current: by the confirmed velocity, then by the guess. Empty: all motions are as likely.
  std::vector<ExpectedMotion> prior{};
  std::optional<PlaceBelief> place{};  ///< where the map was recognised after an outage
};

/// A motion that competes for being the camera's, its matches and its rivals.
struct MotionHypothesis {
  /// Since the map's newest pair. The pose is refined by patches in the end; covariance and rms stay those by corners.
  MotionEstimate motion;
  std::shared_ptr<const LocalMap::View> view;  ///< of the map, shared by all hypotheses of a pair
  std::vector<FeatureMatch> matches;           ///< of the view (reference) and the pair's features (current)
  std::vector<Correspondence> correspondences;
  std::vector<LocalMap::Sighting> sightings;   ///< of the motion's inliers
  double gate = 0.0;                           ///< px: search radius around predicted positions
  double match_time = 0.0, motion_time = 0.0;  ///< of the whole search, s

  Agreement agreement;       ///< matches that rivals explain are left out
  double innovation = 0.0;   ///< squared Mahalanobis distance from the prior; 0 without one
  double probability = 1.0;  ///< that the camera's motion is within tolerance of this one
  /// The likeliest motion beyond tolerance.
  struct Rival {
    Eigen::Isometry3d T_current_reference;
    double probability;
    std::vector<int> features;  ///< of the pair, explained by it alone
    bool is_torn;               ///< a row of the image separates them from the motion's inliers
  };
  std::optional<Rival> rival;
  Matrix6d rivals_moment = Matrix6d::Zero();  ///< second moment of the rivals around the motion, m and rad
  /// Input of Noise::learnShared(): how far the motion of the lasting inliers is from that of all inliers, as a squared
  /// Mahalanobis distance under independent errors of points. None if it is significant: the lasting points' motion is
  /// then taken.
  std::optional<double> lasting_square;

  /// Confirmed sightings of a match's point, four at most.
  int sightingsOf(int match) const;
  bool isLasting(int match) const { return sightingsOf(match) >= kLastingSightings; }

  /// Whether a motion was found and most matches agree with it.
  bool isOfMajority() const { return motion.success && 2 * agreement.inliers > agreement.matches; }

  /// Features of the pair that the inliers matched, without the rejected ones.
  std::vector<int> inlierFeatures(const std::vector<int>& rejected = {}) const;

  /// Counts all matches, and the inliers, into `agreement`.
  void countAgreement();
  /// Counts the inliers alone again, without the rejected features of the pair.
  void countInliers(const std::vector<int>& rejected = {});
  /// Takes another motion. Unless there is a likelier one, the motion before becomes the rival,
  /// supported by the inliers with the features `dropped`.
  void replaceMotion(const MotionScene& scene, const Eigen::Isometry3d& T_current_reference,
                     const std::vector<int>& dropped);

  static constexpr int kLastingSightings = 4;
};

/// Ratio of all points (chosen): a smaller group may be wrong matches that agree by chance.
constexpr double kSignificantRatio = 0.1;

/// Ratio of lasting matches that agree with the camera's motion (chosen); others are wrong.
constexpr double kLastingAgreement = 0.9;

/// Tolerated error of a motion, as a ratio of its distance or angle.
constexpr double kTolerableRatio = 0.03;

/// Whether `motion` differs within tolerance from another one; `apart`: the motion between both.
bool isTolerable(const MotionScene& scene, const Eigen::Isometry3d& motion, const Eigen::Isometry3d& apart);

/// Log Bayes factor (Kass and Raftery 1995) of a measured difference: normal with the prior `covariance`, against zero.
/// `information`: of the measurement.
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
/// as many inliers, if each match agrees with the probability `chance`.
double logFalseAlarms(int matches, int inliers, double chance);

/// Probability that a wrong match, anywhere within `gate` px of its prediction, is within `threshold` px of a motion.
double chanceOfAgreement(double threshold, double gate);

/// Whether two motions T_current_reference are one: they project most of `points` (indices) within so many px.
bool agree(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
           const std::vector<int>& points, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double within);

/// Log-likelihood, up to a constant, that the camera's motion leaves so many confirmed sightings of the `points`
/// unexplained. Points of one mover have correlated errors: they count as effectiveNumber(points).
double logLikelihood(double unexplained_sightings, int points);

/// Log-likelihood ratio of the lasting points' agreement: under the camera's motion, against a mover's.
double logAgreement(const Agreement& agreement);

/// Log-odds that a motion is wrong, by this pair's innovation and agreement of lasting points.
double logOddsWrong(const MotionHypothesis& hypothesis);

/// Weighs hypotheses by prior and likelihood, and merges those of one motion. Returns the likeliest with its rivals.
/// `threshold`, px: of an inlier.
MotionHypothesis chooseMotion(const MotionScene& scene, double threshold, std::vector<MotionHypothesis> hypotheses);

/// Ratio of the cells in an 8x4 grid over the image that have one of these features.
double coverage(const StereoFeatures& features, const std::vector<int>& indices);

}  // namespace sdvo
