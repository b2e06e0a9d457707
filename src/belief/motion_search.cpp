#include "motion_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/stopwatch.hpp"
#include "../common/text.hpp"
#include "../matching/view_matcher.hpp"
#include "../motion/correspondence_arrays.hpp"

namespace sdvo {
namespace {

/// Whether the motion's inliers end at a row of the image, and significantly many matches beyond it are outliers: the
/// image may be torn there.
bool endsAtRow(const MotionHypothesis& found) {
  constexpr double kWrongInliers = 0.05;  // of the inliers (chosen): some wrong matches agree by chance
  const auto row = [&](int i) { return found.correspondences[i].measurement.y(); };
  std::vector<double> rows;
  for (const int i : found.motion.inliers) rows.push_back(row(i));
  const double first = quantile(rows, kWrongInliers), last = quantile(rows, 1.0 - kWrongInliers);
  std::vector<int> above, below;
  for (int i = 0; i < static_cast<int>(found.correspondences.size()); ++i) {
    if (row(i) < first) above.push_back(i);
    if (row(i) > last) below.push_back(i);
  }
  const std::vector<int>& beyond = above.size() > below.size() ? above : below;
  const auto outliers = static_cast<int>(without(beyond, found.motion.inliers).size());
  const double matches = static_cast<double>(found.correspondences.size());
  const double outlier_ratio = 1.0 - static_cast<double>(rows.size()) / matches;
  return outliers > kSignificantRatio * matches &&
         binomialTail(static_cast<int>(beyond.size()), outliers, outlier_ratio) < kTailProbability;
}

}  // namespace

/// The search of one pair's motion.
class MotionSearch::OnePair {
 public:
  OnePair(const MotionSearch& search, const MotionScene& scene, double max_doubt)
      : search_(search),
        scene_(scene),
        max_doubt_(max_doubt),
        camera_(scene.features.camera),
        options_(search.options_.scaled(scene.noise.scale())),
        expected_(scene.guess ? scene.guess : scene.T_current_reference) {}

  MotionHypothesis find() {
    Stopwatch stopwatch;
    view_ = std::make_shared<const LocalMap::View>(scene_.map.view(expected_));
    MotionHypothesis found = findInView();
    found.match_time = match_time_;
    found.motion_time = stopwatch.lap() - match_time_;
    return found;
  }

 private:
  MotionHypothesis findInView() {
    MotionHypothesis found = searchNearExpected();
    const bool needs_rivals = scene_.all_compete || !search_.isBeyondDoubt(found, max_doubt_);
    if (!needs_rivals && refineByPatches(false, found)) return found;
    found = chooseMotion(scene_, options_.inlier_threshold, compete(std::move(found)));
    if (found.motion.success) refineByPatches(true, found);
    return found;
  }

  /// A hypothesis' inliers at the positions of their aligned patches, and the motion refined on these.
  struct Alignment {
    Eigen::Isometry3d T_current_reference;
    std::vector<LocalMap::Sighting> sightings;
    std::vector<Correspondence> measured;
  };

  /// Searches in the radius of a good prediction, then in three times this radius.
  MotionHypothesis searchNearExpected() {
    if (!expected_) return search(search_.matcher_, expected_);
    if (!scene_.searches_wide) {
      MotionHypothesis found = search(search_.matcher_, expected_);
      if (search_.isBeyondDoubt(found, max_doubt_) && !leavesGate(found)) return found;
    }
    return search(search_.wide_matcher_, expected_);
  }

  /// Whether the motion puts more than kSignificantRatio of the points outside of the search radius around the
  /// prediction.
  bool leavesGate(const MotionHypothesis& found) const {
    std::size_t seen = 0, outside = 0;
    for (const Eigen::Vector3d& point : view_->points.positions) {
      const Eigen::Vector3d here = found.motion.T_current_reference * point, expected = *expected_ * point;
      if (std::min(here.z(), expected.z()) < camera_.nearestDepth()) continue;
      const Eigen::Vector3d pixel = camera_.project(here);
      if (!camera_.sees(pixel)) continue;
      ++seen;
      outside += (pixel - camera_.project(expected)).head<2>().norm() > search_.matcher_.options().gate_radius;
    }
    return static_cast<double>(outside) > kSignificantRatio * static_cast<double>(seen);
  }

  MotionHypothesis search(const FeatureMatcher& matcher, const std::optional<Eigen::Isometry3d>& T_current_reference) {
    MotionHypothesis found;
    found.view = view_;
    // Without a prediction: the radius of a circle as large as the image.
    found.gate =
        T_current_reference ? matcher.options().gate_radius : std::sqrt(camera_.width * camera_.height / CV_PI);
    Stopwatch stopwatch;
    found.matches = matcher.match(view_->points, scene_.features, T_current_reference);
    match_time_ += stopwatch.lap();
    found.correspondences = correspond(view_->points, scene_.features, found.matches, scene_.calibration);
    found.motion =
        search_.estimator_.estimate(camera_, found.correspondences, T_current_reference, scene_.noise.scale());
    assess(found);
    return found;
  }

  /// The motion that some of another hypothesis' matches agree on, with all matches that fit it.
  MotionHypothesis searchAmong(const MotionHypothesis& all, const std::vector<int>& subset) const {
    MotionHypothesis found = all;
    std::vector<Correspondence> some;
    some.reserve(subset.size());
    for (const int i : subset) some.push_back(all.correspondences[i]);
    found.motion = search_.estimator_.estimate(camera_, some, std::nullopt, scene_.noise.scale());
    if (found.motion.success) found.motion.inliers = agreeing(all, found.motion.T_current_reference);
    assess(found);
    return found;
  }

  /// Indices of a hypothesis' matches that agree with a motion.
  std::vector<int> agreeing(const MotionHypothesis& all, const Eigen::Isometry3d& T_current_reference) const {
    return PoseProblem(camera_, all.correspondences, options_.inlier_threshold).inliers(T_current_reference);
  }

  /// Sets agreement and innovation. A motion that chance explains fails.
  void assess(MotionHypothesis& found) const {
    found.countAgreement();
    if (!found.motion.success) return;
    found.motion.reason = search_.chanceWords(scene_, found);
    found.motion.success = found.motion.reason.empty();
    const Eigen::Isometry3d T_reference_current = found.motion.T_current_reference.inverse();
    double least = std::numeric_limits<double>::infinity();
    for (const ExpectedMotion& expected : scene_.prior)
      least = std::min(least, expected.normalisedSquare(T_reference_current, found.motion.covariance));
    found.innovation = scene_.prior.empty() ? 0.0 : least;
  }

  /// Searches the other hypotheses: the expected motion may have misled the first search, and movers may have more
  /// points than the static world.
  std::vector<MotionHypothesis> compete(MotionHypothesis first) {
    std::vector<MotionHypothesis> hypotheses;
    hypotheses.push_back(std::move(first));
    if (scene_.guess && scene_.T_current_reference)
      hypotheses.push_back(search(search_.wide_matcher_, scene_.T_current_reference));
    if (expected_) hypotheses.push_back(search(search_.matcher_, std::nullopt));
    const MotionHypothesis all = hypotheses.back();  // without a prediction: it has the most matches
    std::vector<int> lasting, rest;
    for (int i = 0; i < static_cast<int>(all.matches.size()); ++i) {
      if (all.isLasting(i)) lasting.push_back(i);
      rest.push_back(i);
    }
    hypotheses.push_back(searchAmong(all, lasting));
    // A compromise between two motions may have more inliers than the camera's, so matches that fit the expected motion
    // compete as well.
    if (expected_) hypotheses.push_back(searchAmong(all, agreeing(all, *expected_)));
    // Movers may have left copies of themselves in the map, each with its own motion: search outliers repeatedly.
    MotionEstimate peeled = all.motion;
    do {
      rest = without(rest, peeled.inliers);
      hypotheses.push_back(searchAmong(all, rest));
      peeled = hypotheses.back().motion;
    } while (peeled.success);
    return hypotheses;
  }

  /// Refines the motion on aligned patches, and takes motionOfLasting() if there is one. Without `may_change` a change
  /// beyond tolerance is not made: returns false and leaves the motion.
  bool refineByPatches(bool may_change, MotionHypothesis& found) const {
    Alignment aligned = align(found);
    const std::optional<Eigen::Isometry3d> T_lasting = motionOfLasting(aligned, found);
    const bool changes =
        T_lasting && !isTolerable(scene_, *T_lasting, *T_lasting * aligned.T_current_reference.inverse());
    if (changes && !may_change) return false;
    found.motion.T_current_reference = aligned.T_current_reference;
    found.sightings = std::move(aligned.sightings);
    if (T_lasting) dropInliersOff(*T_lasting, aligned.measured, found);
    return true;
  }

  /// Aligns the inliers' patches and refines the motion on them.
  Alignment align(const MotionHypothesis& found) const {
    const StereoFeatures& features = scene_.features;
    const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * scene_.map.newestPose();
    Alignment alignment{found.motion.T_current_reference, {}, {}};
    std::vector<Correspondence> aligned;
    for (auto* correspondences : {&alignment.measured, &aligned}) correspondences->reserve(found.motion.inliers.size());
    alignment.sightings.reserve(found.motion.inliers.size());
    for (const int i : found.motion.inliers) {
      const FeatureMatch& match = found.matches[i];
      const LocalMap::Sighting sighting =
          scene_.map.sight(features, T_camera_origin, found.view->ids[match.reference], match.current);
      alignment.sightings.push_back(sighting);
      alignment.measured.push_back(found.correspondences[i]);
      if (!sighting.aligned) continue;
      const Eigen::Vector2d corner(features.u[match.current], features.v[match.current]);
      alignment.measured.back().measurement =
          measurementOf(features, match.current, scene_.calibration, sighting.measurement.head<2>() - corner);
      aligned.push_back(alignment.measured.back());
    }
    refineMotion(camera_, options_, aligned.size() >= kFewestMeasured ? aligned : alignment.measured,
                 alignment.T_current_reference);
    return alignment;
  }

  /// Motion of the lasting points, if its difference from the motion of all inliers is more likely a mover's (prior's
  /// covariance) than this rig's noise. Else sets lasting_square, if both were compared.
  std::optional<Eigen::Isometry3d> motionOfLasting(const Alignment& aligned, MotionHypothesis& found) const {
    std::vector<Correspondence> lasting, others;
    lasting.reserve(aligned.measured.size()), others.reserve(aligned.measured.size());
    for (std::size_t k = 0; k < aligned.measured.size(); ++k)
      (found.isLasting(found.motion.inliers[k]) ? lasting : others).push_back(aligned.measured[k]);
    if (std::min(lasting.size(), others.size()) < kFewestMeasured || scene_.prior.empty()) return std::nullopt;

    const Eigen::Isometry3d& T = aligned.T_current_reference;
    Eigen::Isometry3d T_lasting = T;
    const NormalEquations equations = refineMotion(camera_, options_, lasting, T_lasting);
    const Vector6d difference = logSE3(T_lasting * T.inverse());
    // Lasting points are a part of all, so the covariance of the difference is the part's less that of all (Hausman
    // 1978). With the others' information O its inverse is H + H O^-1 H.
    MotionRefinementOptions without_steps = options_;
    without_steps.refinement_iterations = 0;
    Eigen::Isometry3d T_all = T;
    const Matrix6d of_others = refineMotion(camera_, without_steps, others, T_all).hessian;
    const Matrix6d of_lasting = equations.hessian;
    const Matrix6d information = (of_lasting + of_lasting * of_others.ldlt().solve(of_lasting)) / equations.variance();
    const double log_factor =
        logBayesFactor<6>(difference, information / scene_.noise.shared(), scene_.prior.front().covariance);
    if (kUnsuspected + log_factor > 0.0) return T_lasting;
    found.lasting_square = difference.dot(information * difference);
    return std::nullopt;
  }

  /// Takes the lasting points' motion, and drops the inliers whose aligned positions do not fit it. A mover slower than
  /// corner noise is an inlier of every hypothesis and biases it.
  void dropInliersOff(const Eigen::Isometry3d& T_lasting, const std::vector<Correspondence>& measured,
                      MotionHypothesis& found) const {
    const std::vector<int> kept = PoseProblem(camera_, measured, scene_.noise.alignedGate()).inliers(T_lasting);
    std::vector<int> inliers, dropped;
    int dropped_sightings = 0;
    std::vector<LocalMap::Sighting> sightings;
    for (int k = 0; k < static_cast<int>(measured.size()); ++k) {
      const int i = found.motion.inliers[k];
      if (!std::binary_search(kept.begin(), kept.end(), k)) {
        dropped.push_back(found.matches[i].current);
        dropped_sightings += found.sightingsOf(i);
        continue;
      }
      inliers.push_back(i);
      sightings.push_back(found.sightings[k]);
    }
    found.replaceMotion(scene_, T_lasting, dropped);
    found.motion.inliers = std::move(inliers);
    found.sightings = std::move(sightings);
    found.countAgreement();
    // Dropped inliers are no evidence against the motion, but lasting points that do not fit stay lasting outliers.
    found.agreement.matches -= static_cast<int>(dropped.size());
    found.agreement.sightings -= dropped_sightings;
  }

  const MotionSearch& search_;
  const MotionScene& scene_;
  const double max_doubt_;
  const StereoCamera& camera_;
  const MotionEstimatorOptions options_;  ///< at this rig's learnt noise
  const std::optional<Eigen::Isometry3d>& expected_;
  std::shared_ptr<const LocalMap::View> view_;
  double match_time_ = 0.0;  ///< s
};

MotionSearch::MotionSearch(const MotionEstimatorOptions& motion) : options_(motion), estimator_(motion) {}

MotionHypothesis MotionSearch::find(const MotionScene& scene, double max_doubt) const {
  return OnePair(*this, scene, max_doubt).find();
}

/// Prior and lasting points do not contradict, and most confirmed sightings agree with the motion, all over the image.
/// Lasting matches that are missing from the share that should agree would be no serious rival even if they moved
/// together.
bool MotionSearch::isBeyondDoubt(const MotionHypothesis& found, double max_doubt) const {
  if (!found.motion.success || found.innovation > noiseGate(6) || logOddsWrong(found) > max_doubt) return false;
  const double agree = found.agreement.lasting_inliers;
  const double missing = kLastingAgreement * found.agreement.lasting_matches - agree;
  if (missing >= options_.min_inliers) {
    constexpr int kSightings = MotionHypothesis::kLastingSightings;
    const int points = static_cast<int>(agree + missing);
    // Log-odds of a rival that explains the missing points in place of those that agree.
    if (logLikelihood(kSightings * agree, points) - logLikelihood(kSightings * missing, points) > kUnsuspected)
      return false;
  }
  return 2 * found.agreement.inlier_sightings >= found.agreement.sightings && !endsAtRow(found);
}

std::string MotionSearch::chanceWords(const MotionScene& scene, const MotionHypothesis& found) const {
  const int matches = found.agreement.matches, inliers = found.agreement.inliers;
  const double chance = chanceOfAgreement(options_.scaled(scene.noise.scale()).inlier_threshold, found.gate);
  if (inliers >= options_.min_inliers && logFalseAlarms(matches, inliers, chance) <= std::log(kTailProbability))
    return "";
  return text(0, "only ", inliers, " of ", matches,
              " matches agree on one motion: too few, or as many as chance gives");
}

}  // namespace sdvo
