#include "motion_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/stopwatch.hpp"
#include "../matching/view_matcher.hpp"
#include "../motion/correspondence_arrays.hpp"
#include "../motion/motion_estimator.hpp"

namespace sdvo {
namespace {

/// Whether the motion's inliers end at a row of the image, and significantly many matches beyond it are outliers: the
/// image may be torn there.
bool endsAtRow(const MotionHypothesis& found) {
  constexpr double kWrongInliers = 0.05;  // of the inliers (chosen): some wrong matches agree by chance
  const auto row = [&](int i) { return found.correspondences[static_cast<std::size_t>(i)].measurement.y(); };
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

MotionSearch::MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
                           const PatchAlignmentOptions& alignment)
    : motion_options_(motion),
      alignment_options_(alignment),
      matcher_(matcher),
      wide_matcher_(matcher.widened()),
      estimator_(motion) {}

MotionHypothesis MotionSearch::find(const MotionScene& scene, double max_doubt) const {
  Stopwatch stopwatch;
  const std::optional<Eigen::Isometry3d>& expected = scene.guess ? scene.guess : scene.T_current_reference;
  const ViewPtr view = std::make_shared<const LocalMap::View>(scene.map.view(expected));
  const double view_time = stopwatch.lap();
  MotionHypothesis found = searchNear(scene, view, expected, max_doubt);
  found.match_time += view_time;
  const bool needs_rivals = scene.all_compete || !isBeyondDoubt(found, max_doubt);
  if (!needs_rivals && refineByPatches(scene, false, found)) return found;
  found = chooseMotion(scene, options(scene).inlier_threshold, compete(scene, view, std::move(found)));
  if (found.motion.success) refineByPatches(scene, true, found);
  return found;
}

/// Refines the motion on aligned patches, and takes motionOfLasting() if there is one. Without `may_change` a change
/// beyond tolerance is not made: returns false and leaves the motion.
bool MotionSearch::refineByPatches(const MotionScene& scene, bool may_change, MotionHypothesis& found) const {
  Stopwatch stopwatch;
  Alignment aligned = align(scene, found);
  const std::optional<Eigen::Isometry3d> T_lasting = motionOfLasting(scene, aligned, found);
  found.motion_time += stopwatch.lap();
  const bool changes = T_lasting && !isTolerable(scene, *T_lasting, *T_lasting * aligned.T_current_reference.inverse());
  if (changes && !may_change) return false;
  found.motion.T_current_reference = aligned.T_current_reference;
  found.sightings = std::move(aligned.sightings);
  if (T_lasting) dropInliersOff(scene, *T_lasting, aligned.measured, found);
  return true;
}

/// Searches the other hypotheses: the expected motion may have misled the first search, and movers may have more points
/// than the static world.
std::vector<MotionHypothesis> MotionSearch::compete(const MotionScene& scene, const ViewPtr& view,
                                                    MotionHypothesis first) const {
  const std::optional<Eigen::Isometry3d>& expected = scene.guess ? scene.guess : scene.T_current_reference;
  std::vector<MotionHypothesis> hypotheses;
  hypotheses.push_back(std::move(first));
  if (scene.guess && scene.T_current_reference)
    hypotheses.push_back(search(wide_matcher_, scene, view, scene.T_current_reference));
  if (expected) hypotheses.push_back(search(matcher_, scene, view, std::nullopt));
  const MotionHypothesis all = hypotheses.back();  // without a prediction: it has the most matches
  std::vector<int> lasting, rest;
  for (int i = 0; i < static_cast<int>(all.matches.size()); ++i) {
    if (all.isLasting(i)) lasting.push_back(i);
    rest.push_back(i);
  }
  hypotheses.push_back(searchAmong(scene, all, lasting));
  // A compromise between two motions may have more inliers than the camera's, so matches that fit the expected motion
  // compete as well.
  if (expected) hypotheses.push_back(searchAmong(scene, all, agreeing(scene, all, *expected)));
  // Movers may have left copies of themselves in the map, each with its own motion: search outliers repeatedly.
  MotionEstimate peeled = all.motion;
  do {
    rest = without(rest, peeled.inliers);
    hypotheses.push_back(searchAmong(scene, all, rest));
    peeled = hypotheses.back().motion;
  } while (peeled.success);
  return hypotheses;
}

/// Prior and lasting points do not contradict, and the majority agrees with the motion, all over the image. The lasting
/// outliers beyond kLastingAgreement would be no serious rival even if they moved together.
bool MotionSearch::isBeyondDoubt(const MotionHypothesis& found, double max_doubt) const {
  if (!found.motion.success || found.innovation > noiseGate(6) || logOddsWrong(found) > max_doubt) return false;
  const double agree = found.agreement.lasting_inliers;
  const double missing = kLastingAgreement * found.agreement.lasting_matches - agree;
  if (missing >= motion_options_.min_inliers) {
    constexpr int kSightings = MotionHypothesis::kLastingSightings;
    const int points = static_cast<int>(agree + missing);
    // Log-odds of a rival that explains the missing points in place of those that agree.
    if (logLikelihood(kSightings * agree, points) - logLikelihood(kSightings * missing, points) > kUnsuspected)
      return false;
  }
  return 2 * found.agreement.inlier_sightings >= found.agreement.sightings && !endsAtRow(found);
}

/// Searches in the radius of a good prediction, then in three times this radius.
MotionHypothesis MotionSearch::searchNear(const MotionScene& scene, const ViewPtr& view,
                                          const std::optional<Eigen::Isometry3d>& T_current_reference,
                                          double max_doubt) const {
  if (!T_current_reference || !matcher_.options().gating) return search(matcher_, scene, view, T_current_reference);
  double match_time = 0.0, motion_time = 0.0;
  if (!scene.searches_wide) {
    MotionHypothesis found = search(matcher_, scene, view, T_current_reference);
    if (isBeyondDoubt(found, max_doubt) && !leavesGate(scene, *T_current_reference, found)) return found;
    match_time = found.match_time, motion_time = found.motion_time;
  }
  MotionHypothesis found = search(wide_matcher_, scene, view, T_current_reference);
  found.match_time += match_time, found.motion_time += motion_time;
  return found;
}

/// Whether the motion puts more than kSignificantRatio of the points outside of the search radius around the
/// prediction.
bool MotionSearch::leavesGate(const MotionScene& scene, const Eigen::Isometry3d& predicted,
                              const MotionHypothesis& found) const {
  const StereoCamera& camera = scene.features.camera;
  const Eigen::Isometry3d& T_current_reference = found.motion.T_current_reference;
  std::size_t seen = 0, outside = 0;
  for (const Eigen::Vector3d& point : found.view->points.positions) {
    const Eigen::Vector3d here = T_current_reference * point, expected = predicted * point;
    if (std::min(here.z(), expected.z()) < camera.nearestDepth()) continue;
    const Eigen::Vector3d pixel = camera.project(here);
    if (!camera.sees(pixel)) continue;
    ++seen;
    outside += (pixel - camera.project(expected)).head<2>().norm() > matcher_.options().gate_radius;
  }
  return static_cast<double>(outside) > kSignificantRatio * static_cast<double>(seen);
}

MotionHypothesis MotionSearch::search(const FeatureMatcher& matcher, const MotionScene& scene, const ViewPtr& view,
                                      const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  MotionHypothesis found;
  found.view = view;
  const StereoCamera& camera = scene.features.camera;
  found.gate = T_current_reference && matcher.options().gating ? matcher.options().gate_radius
                                                               : std::sqrt(camera.width * camera.height / CV_PI);
  Stopwatch stopwatch;
  found.matches = matcher.match(view->points, scene.features, T_current_reference);
  found.match_time = stopwatch.lap();
  found.correspondences = correspond(view->points, scene.features, found.matches, scene.calibration);
  found.motion = estimator_.estimate(camera, found.correspondences, T_current_reference, scene.noise.scale());
  assess(scene, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// The motion that some of another hypothesis' matches agree on, with all matches that fit it.
MotionHypothesis MotionSearch::searchAmong(const MotionScene& scene, const MotionHypothesis& all,
                                           const std::vector<int>& subset) const {
  Stopwatch stopwatch;
  MotionHypothesis found = all;
  found.match_time = 0.0;
  std::vector<Correspondence> some;
  some.reserve(subset.size());
  for (const int i : subset) some.push_back(all.correspondences[static_cast<std::size_t>(i)]);
  found.motion = estimator_.estimate(scene.features.camera, some, std::nullopt, scene.noise.scale());
  if (found.motion.success) found.motion.inliers = agreeing(scene, all, found.motion.T_current_reference);
  assess(scene, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// Indices of a hypothesis' matches that agree with a motion.
std::vector<int> MotionSearch::agreeing(const MotionScene& scene, const MotionHypothesis& all,
                                        const Eigen::Isometry3d& T_current_reference) const {
  return PoseProblem(scene.features.camera, all.correspondences, options(scene).inlier_threshold)
      .inliers(T_current_reference);
}

/// Sets agreement and innovation. A motion that chance explains fails.
void MotionSearch::assess(const MotionScene& scene, MotionHypothesis& found) const {
  found.countAgreement();
  if (!found.motion.success) return;
  found.motion.reason = chanceWords(scene, found);
  found.motion.success = found.motion.reason.empty();
  const Eigen::Isometry3d T_reference_current = found.motion.T_current_reference.inverse();
  double least = std::numeric_limits<double>::infinity();
  for (const ExpectedMotion& expected : scene.prior)
    least = std::min(least, expected.normalisedSquare(T_reference_current, found.motion.covariance));
  found.innovation = scene.prior.empty() ? 0.0 : least;
}

MotionEstimatorOptions MotionSearch::options(const MotionScene& scene) const {
  return motion_options_.scaled(scene.noise.scale());
}

std::string MotionSearch::chanceWords(const MotionScene& scene, const MotionHypothesis& found) const {
  const int matches = found.agreement.matches, inliers = found.agreement.inliers;
  const double chance = chanceOfAgreement(options(scene).inlier_threshold, found.gate);
  if (inliers >= motion_options_.min_inliers && logFalseAlarms(matches, inliers, chance) <= std::log(kTailProbability))
    return "";
  return "only " + std::to_string(inliers) + " of " + std::to_string(matches) +
         " matches agree on one motion: too few, or as many as chance gives";
}

/// Aligns the inliers' patches and refines the motion on them.
MotionSearch::Alignment MotionSearch::align(const MotionScene& scene, const MotionHypothesis& found) const {
  const StereoFeatures& features = scene.features;
  const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * scene.map.newestPose();
  Alignment alignment{found.motion.T_current_reference, {}, {}};
  std::vector<Correspondence> aligned;
  for (auto* correspondences : {&alignment.measured, &aligned}) correspondences->reserve(found.motion.inliers.size());
  alignment.sightings.reserve(found.motion.inliers.size());
  for (const int i : found.motion.inliers) {
    const FeatureMatch& match = found.matches[i];
    const LocalMap::Sighting sighting =
        scene.map.sight(alignment_options_, features, T_camera_origin, found.view->ids[match.reference], match.current);
    alignment.sightings.push_back(sighting);
    alignment.measured.push_back(found.correspondences[i]);
    if (!sighting.aligned) continue;
    const Eigen::Vector2d corner(features.u[match.current], features.v[match.current]);
    alignment.measured.back().measurement =
        measurementOf(features, match.current, scene.calibration, sighting.measurement.head<2>() - corner);
    aligned.push_back(alignment.measured.back());
  }
  refineMotion(features.camera, options(scene), aligned.size() >= kFewestMeasured ? aligned : alignment.measured,
               alignment.T_current_reference);
  return alignment;
}

/// Motion of the lasting points, if its difference from the motion of all inliers is more likely a mover's (prior's
/// covariance) than this rig's noise. Else sets lasting_square, if both were compared.
std::optional<Eigen::Isometry3d> MotionSearch::motionOfLasting(const MotionScene& scene, const Alignment& aligned,
                                                               MotionHypothesis& found) const {
  const StereoCamera& camera = scene.features.camera;
  std::vector<Correspondence> lasting, others;
  lasting.reserve(aligned.measured.size()), others.reserve(aligned.measured.size());
  for (std::size_t k = 0; k < aligned.measured.size(); ++k)
    (found.isLasting(found.motion.inliers[k]) ? lasting : others).push_back(aligned.measured[k]);
  if (std::min(lasting.size(), others.size()) < kFewestMeasured || scene.prior.empty()) return std::nullopt;

  const Eigen::Isometry3d& T = aligned.T_current_reference;
  Eigen::Isometry3d T_lasting = T;
  const NormalEquations equations = refineMotion(camera, options(scene), lasting, T_lasting);
  const Vector6d difference = logSE3(T_lasting * T.inverse());
  // Lasting points are a part of all, so the covariance of the difference is the part's less that of all (Hausman
  // 1978). With the others' information O its inverse is H + H O^-1 H.
  MotionEstimatorOptions without_steps = options(scene);
  without_steps.refinement_iterations = 0;
  Eigen::Isometry3d T_all = T;
  const Matrix6d of_others = refineMotion(camera, without_steps, others, T_all).hessian;
  const Matrix6d of_lasting = equations.hessian;
  const Matrix6d information = (of_lasting + of_lasting * of_others.ldlt().solve(of_lasting)) / equations.variance();
  const double log_factor =
      logBayesFactor<6>(difference, information / scene.noise.shared(), scene.prior.front().covariance);
  if (kUnsuspected + log_factor > 0.0) return T_lasting;
  found.lasting_square = difference.dot(information * difference);
  return std::nullopt;
}

/// Takes the lasting points' motion, and drops the inliers whose aligned positions do not fit it. A mover slower than
/// corner noise is an inlier of every hypothesis and biases it.
void MotionSearch::dropInliersOff(const MotionScene& scene, const Eigen::Isometry3d& T_lasting,
                                  const std::vector<Correspondence>& measured, MotionHypothesis& found) const {
  const std::vector<int> kept =
      PoseProblem(scene.features.camera, measured, scene.noise.alignedGate()).inliers(T_lasting);
  std::vector<int> inliers, dropped;
  int dropped_sightings = 0;
  std::vector<LocalMap::Sighting> sightings;
  for (int k = 0; k < static_cast<int>(measured.size()); ++k) {
    const int i = found.motion.inliers[static_cast<std::size_t>(k)];
    if (!std::binary_search(kept.begin(), kept.end(), k)) {
      dropped.push_back(found.matches[static_cast<std::size_t>(i)].current);
      dropped_sightings += found.sightingsOf(i);
      continue;
    }
    inliers.push_back(i);
    sightings.push_back(found.sightings[static_cast<std::size_t>(k)]);
  }
  found.replaceMotion(scene, T_lasting, dropped);
  found.motion.inliers = std::move(inliers);
  found.sightings = std::move(sightings);
  found.countAgreement();
  found.agreement.matches -= static_cast<int>(dropped.size());
  found.agreement.sightings -= dropped_sightings;
}

}  // namespace sdvo
