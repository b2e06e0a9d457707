#include "motion_hypotheses.hpp"

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "../common/statistics.hpp"
#include "../motion/pose_problem.hpp"

namespace sdvo {
namespace {

constexpr double kLogOddsOfSighting = 0.75;  // that a point stands still, by each confirmed sighting (chosen)
constexpr double kTorn = 0.1;  // odds (chosen) of a torn image against a mover, where a row separates two motions

/// Of n observations that are correlated by this coefficient (Kish 1965, the design effect): 2.5 at most. Points of one
/// object move together, and a view has few objects.
double effectiveNumber(double n) {
  constexpr double kCorrelation = 0.4;
  return n > 0.0 ? n / (1.0 + (n - 1.0) * kCorrelation) : 0.0;
}

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

/// The prior's logarithm, relative to its best motion, is bounded by the probability that it is wrong.
double logPrior(const MotionHypothesis& hypothesis) {
  return std::max(-0.5 * hypothesis.innovation, std::log(kTailProbability));
}

std::vector<int> sorted(std::vector<int> values) {
  std::sort(values.begin(), values.end());
  return values;
}

using Points = std::vector<Eigen::Vector2d>;  // px, in the left image

/// Mean of the points in each square of kCorrelatedSide, because errors of neighbours are correlated.
Points meansBySquares(const Points& pixels) {
  std::map<std::pair<int, int>, std::pair<Eigen::Vector2d, int>> parts;
  for (const Eigen::Vector2d& pixel : pixels) {
    const Eigen::Array2i part = (pixel / kCorrelatedSide).array().floor().cast<int>();
    auto& [sum, count] = parts.try_emplace({part.x(), part.y()}, Eigen::Vector2d(0.0, 0.0), 0).first->second;
    sum += pixel, ++count;
  }
  Points means;
  for (const auto& [part, sum] : parts) means.push_back(sum.first / sum.second);
  return means;
}

double nearest(const Eigen::Vector2d& pixel, const Points& others) {
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& other : others)
    if (&other != &pixel) least = std::min(least, (other - pixel).squaredNorm());
  return least;
}

/// Whether some points are an object's among the others. Points of an object have each other for neighbours. Points
/// that miss a motion by errors of rectification or matching lie among the others. Join counts (Cliff and Ord 1973)
/// against random places.
bool isObject(const Points& points, const Points& others) {
  const Points inside = meansBySquares(points), outside = meansBySquares(others);
  if (inside.size() < 2) return false;
  if (outside.empty()) return true;
  const auto joined = std::count_if(inside.begin(), inside.end(), [&](const Eigen::Vector2d& pixel) {
    return nearest(pixel, inside) < nearest(pixel, outside);
  });
  const double chance = static_cast<double>(inside.size()) / static_cast<double>(inside.size() + outside.size());
  return binomialTail(static_cast<int>(inside.size()), static_cast<int>(joined), chance) < kTailProbability;
}

/// Whether a row of the image separates points from others, as in a torn or damaged image. Their numbers do not imply
/// which part shows the camera's motion. If points fall on either side by chance, with the ratios p and q of all n, one
/// division has a probability of p^(p n) q^(q n), which is at most max(p, q)^n.
bool areDivided(const Points& points, const Points& others) {
  constexpr double kWrongInliers = 0.1;  // of either side (chosen): some wrong matches agree by chance
  const auto rowsOf = [](const Points& pixels) {
    std::vector<double> rows;
    for (const Eigen::Vector2d& part : meansBySquares(pixels)) rows.push_back(part.y());
    return rows;
  };
  const std::vector<double> rows = rowsOf(points), other_rows = rowsOf(others);
  const double all = static_cast<double>(rows.size() + other_rows.size());
  const double larger = static_cast<double>(std::max(rows.size(), other_rows.size()));
  if (std::pow(larger / all, all) >= kTailProbability) return false;
  return quantile(rows, 1.0 - kWrongInliers) <= quantile(other_rows, kWrongInliers) ||
         quantile(other_rows, 1.0 - kWrongInliers) <= quantile(rows, kWrongInliers);
}

/// The matches that each hypothesis of a pair explains, among the matches of all hypotheses.
class Explanations {
 public:
  Explanations(const MotionScene& scene, double threshold, const std::vector<MotionHypothesis>& hypotheses)
      : scene_(scene), hypotheses_(hypotheses) {
    std::set<std::pair<int, int>> pairs;
    std::vector<Correspondence> matches;
    for (const MotionHypothesis& hypothesis : hypotheses)
      for (std::size_t i = 0; i < hypothesis.matches.size(); ++i) {
        const FeatureMatch& match = hypothesis.matches[i];
        if (!pairs.emplace(match.reference, match.current).second) continue;
        matches.push_back(hypothesis.correspondences[i]);
        sightings_.push_back(hypothesis.sightingsOf(static_cast<int>(i)));
        pixels_.push_back(hypothesis.correspondences[i].measurement.head<2>());
      }
    const PoseProblem problem(scene.features.camera, matches, threshold);
    for (const MotionHypothesis& hypothesis : hypotheses) {
      explained_.emplace_back(matches.size(), false);
      for (const int i : problem.inliers(hypothesis.motion.T_current_reference)) explained_.back()[i] = true;
    }
  }

  /// Log-odds of hypothesis a against b, by the prior and the points that only one of them explains.
  double logRatio(std::size_t a, std::size_t b) const {
    return logPrior(hypotheses_[a]) - logPrior(hypotheses_[b]) + logRatioOfPoints(a, b);
  }

  /// Whether two hypotheses are one motion for the inliers of both. Far points alone do not distinguish rotation from
  /// translation.
  bool areOne(std::size_t a, std::size_t b) const {
    const Eigen::Isometry3d& T_a = hypotheses_[a].motion.T_current_reference;
    const Eigen::Isometry3d& T_b = hypotheses_[b].motion.T_current_reference;
    const auto explains_both = [&](const MotionHypothesis& h) {
      return agree(scene_.features.camera, h.correspondences, h.motion.inliers, T_a, T_b, scene_.noise.sameMotion());
    };
    return explains_both(hypotheses_[a]) && explains_both(hypotheses_[b]) && !areTorn(a, b);
  }

  /// Whether a row separates the points of one hypothesis from those that only the other one explains. Each must
  /// explain more than kSignificantRatio alone.
  bool areTorn(std::size_t a, std::size_t b) const {
    const Points of_a = explainedBy(a), of_b = explainedBy(b), only_a = explainedBy(a, b), only_b = explainedBy(b, a);
    const double all = static_cast<double>(of_a.size() + only_b.size());
    if (static_cast<double>(std::min(only_a.size(), only_b.size())) < kSignificantRatio * all) return false;
    return areDivided(of_a, only_b) || areDivided(of_b, only_a);
  }

  /// Minimax: the hypothesis whose largest log-odds against it are smallest. Pairwise ratios compare different points,
  /// so they need not be transitive.
  std::size_t likeliest() const {
    const std::size_t count = hypotheses_.size();
    std::vector<double> against(count, -std::numeric_limits<double>::infinity());
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < a; ++b) {
        const double ratio = logRatio(a, b);
        against[a] = std::max(against[a], -ratio);
        against[b] = std::max(against[b], ratio);
      }
    return static_cast<std::size_t>(std::min_element(against.begin(), against.end()) - against.begin());
  }

 private:
  /// Log-likelihood ratio of hypotheses a and b, by the points that only one of them explains.
  double logRatioOfPoints(std::size_t a, std::size_t b) const {
    double sightings_a = 0.0, sightings_b = 0.0;
    for (std::size_t i = 0; i < sightings_.size(); ++i)
      if (explained_[a][i] != explained_[b][i]) (explained_[a][i] ? sightings_a : sightings_b) += sightings_[i];
    const Points only_a = explainedBy(a, b), only_b = explainedBy(b, a);
    const int points = static_cast<int>(only_a.size() + only_b.size());
    const double log_a = logLikelihood(sightings_b, points), log_b = logLikelihood(sightings_a, points);
    // If the image is torn, either side may be the camera's with odds of kTorn at least, however few its points are.
    if (areTorn(a, b)) return std::log((std::exp(log_a) + kTorn) / (std::exp(log_b) + kTorn));
    if (isObject(only_a, only_b) || isObject(only_b, only_a)) return log_a - log_b;
    return kLogOddsOfSighting * (sightings_a - sightings_b);  // scattered points have independent errors
  }

  /// Positions in the left image, px, that a hypothesis explains and `but` does not.
  Points explainedBy(std::size_t hypothesis, std::optional<std::size_t> but = {}) const {
    Points points;
    for (std::size_t i = 0; i < pixels_.size(); ++i)
      if (explained_[hypothesis][i] && !(but && explained_[*but][i])) points.push_back(pixels_[i]);
    return points;
  }

  const MotionScene& scene_;
  const std::vector<MotionHypothesis>& hypotheses_;
  std::vector<double> sightings_;             ///< of each match
  Points pixels_;                             ///< of each match
  std::vector<std::vector<bool>> explained_;  ///< by each hypothesis
};

/// A motion of features that the chosen one does not explain, more than chance gives.
struct RivalMotion {
  std::size_t hypothesis;
  double log_ratio;           ///< log-odds against the likeliest hypothesis
  std::vector<int> features;  ///< of the pair, explained by it alone
  bool is_torn;               ///< a row of the image separates both
};

/// Rivals of the chosen motion, each once. `chosen` is the estimate of the motion of `likeliest` with the most inliers.
/// Log-odds are against `likeliest`; inliers are those of `chosen`.
std::vector<RivalMotion> rivalsOf(double threshold, const std::vector<MotionHypothesis>& hypotheses,
                                  const Explanations& explanations, std::size_t likeliest, std::size_t chosen) {
  const std::vector<int> own = sorted(hypotheses[chosen].inlierFeatures());
  const int outliers = hypotheses[chosen].agreement.matches - hypotheses[chosen].agreement.inliers;
  std::vector<RivalMotion> rivals;
  for (std::size_t k = 0; k < hypotheses.size(); ++k) {
    if (explanations.areOne(chosen, k)) continue;
    RivalMotion rival{k, explanations.logRatio(k, likeliest), without(sorted(hypotheses[k].inlierFeatures()), own),
                      explanations.areTorn(chosen, k)};
    const int features = static_cast<int>(rival.features.size());
    const double chance = chanceOfAgreement(threshold, hypotheses[k].gate);
    // A rival that searched in a wider gate may have more points than the chosen one has outliers.
    if (logFalseAlarms(std::max(outliers, features), features, chance) > std::log(kTailProbability)) continue;
    const auto same = std::find_if(rivals.begin(), rivals.end(), [&](const RivalMotion& before) {
      return explanations.areOne(before.hypothesis, k);
    });
    if (same == rivals.end())
      rivals.push_back(std::move(rival));
    else if (same->log_ratio < rival.log_ratio)
      *same = std::move(rival);
  }
  return rivals;
}

/// Sets the chosen motion's probability, its likeliest rival, and the moment of the rivals around it.
void compareWithRivals(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses,
                       const std::vector<RivalMotion>& rivals, MotionHypothesis& chosen) {
  const auto motionOf = [&](const RivalMotion& rival) -> const Eigen::Isometry3d& {
    return hypotheses[rival.hypothesis].motion.T_current_reference;
  };
  MotionMixture mixture;
  for (const RivalMotion& rival : rivals) {
    // Both motions have the same reference.
    const Eigen::Isometry3d apart = chosen.motion.T_current_reference * motionOf(rival).inverse();
    mixture.add({rival.log_ratio, momentOf(logSE3(apart)), ""});
  }
  chosen.probability = mixture.probability();
  chosen.rivals_moment = mixture.moment();
  std::vector<int> explained;
  for (const RivalMotion& rival : rivals) {
    explained.insert(explained.end(), rival.features.begin(), rival.features.end());
    const double probability = mixture.probability(rival.log_ratio);
    if (isTolerable(scene, chosen.motion.T_current_reference,
                    chosen.motion.T_current_reference * motionOf(rival).inverse()))
      chosen.probability += probability;
    else if (!chosen.rival || chosen.rival->probability < probability)
      chosen.rival = {motionOf(rival), probability, rival.features, rival.is_torn};
  }
  // Matches that rivals explain are no evidence against the chosen motion.
  explained = sorted(std::move(explained));
  for (int i = 0; i < static_cast<int>(chosen.matches.size()); ++i) {
    const int feature = chosen.matches[i].current;
    if (!std::binary_search(explained.begin(), explained.end(), feature)) continue;
    --chosen.agreement.matches;
    chosen.agreement.lasting_matches -= chosen.isLasting(i);
    chosen.agreement.sightings -= chosen.sightingsOf(i);
  }
}

}  // namespace

double logOdds(double probability) {
  return std::log(probability / (1.0 - probability));
}

double probabilityOf(double log_odds) {
  return 1.0 / (1.0 + std::exp(-log_odds));
}

PlaceBelief choosePlace(const FoundPlace& place, const std::vector<ExpectedMotion>& prior) {
  const auto logWeight = [&](const Eigen::Isometry3d& T_current_newest) {
    double log_weight = prior.empty() ? 0.0 : std::log(kTailProbability);  // the prior may be wrong
    for (const ExpectedMotion& expected : prior)
      log_weight = std::max(log_weight, -0.5 * expected.normalisedSquare(T_current_newest.inverse(), Matrix6d::Zero()));
    return log_weight;
  };
  Eigen::Isometry3d chosen = place.T_current_newest, other = place.alike.value_or(chosen);
  if (logWeight(other) > logWeight(chosen)) std::swap(chosen, other);
  PlaceBelief belief{chosen, {}};
  if (place.alike)
    belief.mixture.add({logWeight(other) - logWeight(chosen), momentOf(logSE3(chosen * other.inverse())),
                        "other places of the map look alike"});
  // The map may have matched by chance, while one of the priors is right. Against a place that no prior explains, the
  // odds of this are place.chance. Against a place that a prior explains, they are kTailProbability times smaller.
  const double by_chance = kTailProbability * place.chance;
  for (const ExpectedMotion& expected : prior)
    belief.mixture.add({std::log(by_chance) - logWeight(chosen),
                        momentOf(expected.innovation(chosen.inverse())) + expected.covariance,
                        "the place may be another one"});
  return belief;
}

int MotionHypothesis::sightingsOf(int match) const {
  return std::min(view->seen[matches[match].reference], kLastingSightings);
}

void MotionHypothesis::replaceMotion(const MotionScene& scene, const Eigen::Isometry3d& T_current_reference,
                                     const std::vector<int>& dropped) {
  const Eigen::Isometry3d T_found = std::exchange(motion.T_current_reference, T_current_reference);
  const Eigen::Isometry3d apart = T_current_reference * T_found.inverse();
  const int points = static_cast<int>(motion.inliers.size());
  double kept_sightings = 0.0, dropped_sightings = 0.0;
  for (const int i : motion.inliers)
    (contains(dropped, matches[i].current) ? dropped_sightings : kept_sightings) += sightingsOf(i);
  // Two bodies move: the found motion is that of the dropped points, the new one that of the others. Each leaves the
  // points of the other one unexplained.
  const double found_is_right =
      probabilityOf(logLikelihood(kept_sightings, points) - logLikelihood(dropped_sightings, points));
  rivals_moment += found_is_right * momentOf(logSE3(apart));
  if (isTolerable(scene, T_current_reference, apart)) return;
  probability *= 1.0 - found_is_right;
  if (!rival || rival->probability < found_is_right) rival = {T_found, found_is_right, dropped, false};
}

std::vector<int> MotionHypothesis::inlierFeatures(const std::vector<int>& rejected) const {
  std::vector<int> features;
  features.reserve(motion.inliers.size());
  for (const int i : motion.inliers)
    if (!contains(rejected, matches[i].current)) features.push_back(matches[i].current);
  return features;
}

void MotionHypothesis::countAgreement() {
  agreement.matches = static_cast<int>(matches.size());
  agreement.lasting_matches = agreement.sightings = 0;
  for (int i = 0; i < agreement.matches; ++i)
    agreement.lasting_matches += isLasting(i), agreement.sightings += sightingsOf(i);
  countInliers();
}

void MotionHypothesis::countInliers(const std::vector<int>& rejected) {
  agreement.inliers = agreement.lasting_inliers = agreement.inlier_sightings = 0;
  for (const int i : motion.inliers) {
    if (contains(rejected, matches[i].current)) continue;
    ++agreement.inliers;
    agreement.lasting_inliers += isLasting(i);
    agreement.inlier_sightings += sightingsOf(i);
  }
}

bool isTolerable(const MotionScene& scene, const Eigen::Isometry3d& motion, const Eigen::Isometry3d& apart) {
  constexpr double kAngle = 0.02;  // rad (chosen: about a degree)
  return apart.translation().norm() <= scene.tolerance + kTolerableRatio * motion.translation().norm() &&
         logSO3(apart.linear()).norm() <= kAngle + kTolerableRatio * logSO3(motion.linear()).norm();
}

double logFalseAlarms(int matches, int inliers, double chance) {
  constexpr int kSample = 3;
  if (inliers <= kSample) return 0.0;
  const auto logChoose = [](int n, int k) {
    return std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0);
  };
  return std::log(matches - kSample) + logChoose(matches, inliers) + logChoose(inliers, kSample) +
         (inliers - kSample) * std::log(chance);
}

double chanceOfAgreement(double threshold, double gate) {
  // A ball in (u_left, v_left, u_right) of radius `threshold`, and a cylinder of radius and half length `gate`. At
  // most one half (chosen), where the gate is hardly wider than the threshold.
  return std::min(2.0 / 3.0 * std::pow(threshold / gate, 3), 0.5);
}

bool agree(const StereoCamera& camera, const std::vector<Correspondence>& correspondences,
           const std::vector<int>& points, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double within) {
  const auto same = std::count_if(points.begin(), points.end(), [&](int i) {
    const Eigen::Vector3d in_a = a * correspondences[i].point, in_b = b * correspondences[i].point;
    if (std::min(in_a.z(), in_b.z()) < camera.nearestDepth()) return false;
    return (camera.project(in_a) - camera.project(in_b)).norm() < within;
  });
  return 2 * static_cast<std::size_t>(same) > points.size();
}

double logLikelihood(double unexplained_sightings, int points) {
  if (points == 0) return 0.0;
  return -effectiveNumber(points) * kLogOddsOfSighting * unexplained_sightings / points;
}

double logAgreement(const Agreement& agreement) {
  if (agreement.lasting_matches == 0) return 0.0;
  // Probability that a lasting point is a mover's, and agrees with the mover's motion.
  const double of_mover = probabilityOf(-kLogOddsOfSighting * MotionHypothesis::kLastingSightings);
  const double ratio = static_cast<double>(agreement.lasting_inliers) / agreement.lasting_matches;
  return effectiveNumber(agreement.lasting_matches) *
         (ratio * std::log(kLastingAgreement / of_mover) +
          (1.0 - ratio) * std::log((1.0 - kLastingAgreement) / (1.0 - of_mover)));
}

double logOddsWrong(const MotionHypothesis& hypothesis) {
  return kUnsuspected - logPrior(hypothesis) - logAgreement(hypothesis.agreement);
}

MotionHypothesis chooseMotion(const MotionScene& scene, double threshold, std::vector<MotionHypothesis> hypotheses) {
  const auto by_inliers = [](const MotionHypothesis& a, const MotionHypothesis& b) {
    return a.motion.inliers.size() < b.motion.inliers.size();
  };
  const auto failures = std::stable_partition(hypotheses.begin(), hypotheses.end(),
                                              [](const MotionHypothesis& h) { return h.motion.success; });
  // The reason of the failure with most inliers.
  if (failures == hypotheses.begin()) return *std::max_element(hypotheses.begin(), hypotheses.end(), by_inliers);
  hypotheses.erase(failures, hypotheses.end());
  const Explanations explanations(scene, threshold, hypotheses);
  const std::size_t likeliest = explanations.likeliest();
  // Of the estimates of this motion the one with most inliers.
  std::size_t largest = likeliest;
  for (std::size_t k = 0; k < hypotheses.size(); ++k)
    if (by_inliers(hypotheses[largest], hypotheses[k]) && explanations.areOne(likeliest, k)) largest = k;
  MotionHypothesis chosen = hypotheses[largest];
  compareWithRivals(scene, hypotheses, rivalsOf(threshold, hypotheses, explanations, likeliest, largest), chosen);
  return chosen;
}

double coverage(const StereoFeatures& features, const std::vector<int>& indices) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  const StereoCamera& camera = features.camera;
  for (const int i : indices)
    cells.set(
        static_cast<std::size_t>(gridCell(features.u[i], features.v[i], camera.width, camera.height, kColumns, kRows)));
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

}  // namespace sdvo
