#include "stereo_descriptor_vo/odometry/motion_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>

#include "ascending_rows.hpp"
#include "stereo_descriptor_vo/common/stopwatch.hpp"
#include "stereo_descriptor_vo/odometry/correspondences.hpp"
#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

namespace sdvo {
namespace {

constexpr double kElsewhere = 0.6;  // px, of aligned positions; up to 0.5 where nothing moved
// Chi-square of six, by which it is worth to look further, and to follow few points rather than all. Errors of
// neighbouring points are not independent: up to 170 where nothing moved.
constexpr double kSuspicious = 100.0, kCertain = 200.0;
// The same for each point, in variances of its residual: a part of its noise is common to many, so the sum grows with
// their number. Measured where the sum exceeds kCertain: up to 1.5 where nothing moved, 1.7 and more with faults
// (docs/decisions.md).
constexpr double kCertainOfOne = 1.5;

}  // namespace

MotionSearch::MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
                           const PatchAlignmentOptions& alignment, const PoseVerdictOptions& verdict)
    : motion_options_(motion),
      alignment_options_(alignment),
      verdict_options_(verdict),
      matcher_(matcher),
      wide_matcher_(matcher.widened()),
      estimator_(motion),
      choice_(verdict, motion.min_inliers) {}

MotionHypothesis MotionSearch::find(const MotionScene& scene) const {
  const StereoCamera& camera = scene.features.camera;
  const auto take = [](Alignment& aligned, MotionHypothesis& found) {
    found.motion.T_current_reference = aligned.T_current_reference;
    found.sightings = std::move(aligned.sightings);
  };
  Stopwatch stopwatch;
  const std::optional<Eigen::Isometry3d>& prior = scene.guess ? scene.guess : scene.T_current_reference;
  const ViewPtr view = std::make_shared<const LocalMap::View>(scene.map.view(prior));
  const double view_time = stopwatch.lap();
  MotionHypothesis found = searchNear(scene, view, prior);
  found.match_time += view_time;
  if (found.verdict.trust == Trust::kSound && !scene.contested) {
    stopwatch.lap();
    Alignment aligned = align(scene, found);
    const bool strays = motionOfLasting(camera, found, aligned, kSuspicious).has_value();
    found.motion_time += stopwatch.lap();
    if (!strays) {
      take(aligned, found);
      return found;
    }
  }

  // The prior itself may be what misled the search, and what moves by itself may outnumber the world.
  std::vector<MotionHypothesis> hypotheses;
  hypotheses.push_back(std::move(found));
  if (scene.guess && scene.T_current_reference)
    hypotheses.push_back(searchNear(scene, view, scene.T_current_reference));
  if (prior) hypotheses.push_back(search(matcher_, scene, view, std::nullopt));
  const MotionHypothesis all = hypotheses.back();
  std::vector<int> lasting, rest;
  for (int i = 0; i < static_cast<int>(all.matches.size()); ++i) {
    if (all.isLasting(i)) lasting.push_back(i);
    rest.push_back(i);
  }
  hypotheses.push_back(searchAmong(scene, all, lasting));
  // A compromise between two motions may have more inliers than the one that goes on as before.
  if (prior) hypotheses.push_back(searchAmong(scene, all, agreeing(scene, all, *prior)));
  // What moves by itself may have left copies of itself in the map, each with a motion of its own.
  constexpr int kMotions = 4;
  MotionEstimate peeled = all.motion;
  for (int k = 0; k < kMotions && (k == 0 || peeled.success); ++k) {
    rest = without(rest, peeled.inliers);
    hypotheses.push_back(searchAmong(scene, all, rest));
    peeled = hypotheses.back().motion;
  }
  found = choice_.choose(scene, std::move(hypotheses));
  if (found.verdict.trust == Trust::kNone) return found;
  stopwatch.lap();
  Alignment aligned = align(scene, found);
  const std::optional<Eigen::Isometry3d> T_lasting = motionOfLasting(camera, found, aligned, kCertain);
  take(aligned, found);
  if (T_lasting) keepTo(scene, *T_lasting, aligned.measured, found);
  found.motion_time += stopwatch.lap();
  return found;
}

/// First where a good prediction has the points, then three times as far.
MotionHypothesis MotionSearch::searchNear(const MotionScene& scene, const ViewPtr& view,
                                          const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  if (!T_current_reference || !matcher_.options().gating) return search(matcher_, scene, view, T_current_reference);
  double match_time = 0.0, motion_time = 0.0;
  if (!scene.contested) {
    MotionHypothesis found = search(matcher_, scene, view, T_current_reference);
    if (found.verdict.trust == Trust::kSound && !leavesGate(scene, *T_current_reference, found)) return found;
    match_time = found.match_time, motion_time = found.motion_time;
  }
  MotionHypothesis found = search(wide_matcher_, scene, view, T_current_reference);
  found.match_time += match_time, found.motion_time += motion_time;
  return found;
}

/// Whether the motion found has a good part of the points where the search did not look for them.
bool MotionSearch::leavesGate(const MotionScene& scene, const Eigen::Isometry3d& predicted,
                              const MotionHypothesis& found) const {
  constexpr double kGoodPart = 0.1;
  const StereoCamera& camera = scene.features.camera;
  const Eigen::Isometry3d& T_current_reference = found.motion.T_current_reference;
  std::size_t seen = 0, outside = 0;
  for (const Eigen::Vector3d& point : found.view->rows.positions) {
    const Eigen::Vector3d here = T_current_reference * point, expected = predicted * point;
    if (here.z() <= 0.0 || expected.z() <= 0.0) continue;
    const Eigen::Vector3d pixel = camera.project(here);
    if (!camera.sees(pixel)) continue;
    ++seen;
    outside += (pixel - camera.project(expected)).head<2>().norm() > matcher_.options().gate_radius;
  }
  return static_cast<double>(outside) > kGoodPart * static_cast<double>(seen);
}

MotionHypothesis MotionSearch::search(const FeatureMatcher& matcher, const MotionScene& scene, const ViewPtr& view,
                                      const std::optional<Eigen::Isometry3d>& T_current_reference) const {
  MotionHypothesis found;
  found.view = view;
  Stopwatch stopwatch;
  found.matches = matcher.match(view->rows, scene.features, T_current_reference);
  found.match_time = stopwatch.lap();
  found.correspondences = correspond(view->rows, scene.features, found.matches, scene.calibration);
  found.motion = estimator_.estimate(scene.features.camera, found.correspondences, T_current_reference);
  weigh(scene, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// A motion that some of another hypothesis' matches agree on, and whatever else does.
MotionHypothesis MotionSearch::searchAmong(const MotionScene& scene, const MotionHypothesis& all,
                                           const std::vector<int>& subset) const {
  Stopwatch stopwatch;
  const StereoCamera& camera = scene.features.camera;
  MotionHypothesis found = all;
  found.match_time = 0.0;
  found.motion = estimateAmong(estimator_, camera, all.correspondences, subset);
  if (found.motion.success) found.motion.inliers = agreeing(scene, all, found.motion.T_current_reference);
  weigh(scene, found);
  found.motion_time = stopwatch.lap();
  return found;
}

/// Matches of a hypothesis that agree with a motion.
std::vector<int> MotionSearch::agreeing(const MotionScene& scene, const MotionHypothesis& all,
                                        const Eigen::Isometry3d& T_current_reference) const {
  return PoseProblem(scene.features.camera, all.correspondences, motion_options_.inlier_threshold)
      .inliers(T_current_reference);
}

/// Gathers what speaks for the motion found and judges it.
void MotionSearch::weigh(const MotionScene& scene, MotionHypothesis& found) const {
  PoseEvidence& evidence = found.evidence;
  evidence = {};
  evidence.matches = static_cast<int>(found.matches.size());
  for (int i = 0; i < evidence.matches; ++i) evidence.lasting_matches += found.isLasting(i);
  countInliers(found);
  evidence.covariance = found.motion.covariance;
  evidence.dt = static_cast<double>(scene.features.stamp - scene.map.newestStamp()) * 1e-9;
  evidence.velocity = scene.velocity;
  evidence.velocity_age = scene.velocity_age;
  if (scene.guess) evidence.guess = scene.guess->inverse();
  found.verdict = found.motion.success ? judgePose(verdict_options_, motion_options_.min_inliers, evidence)
                                       : PoseVerdict{Trust::kNone, found.motion.reason};
}

void MotionSearch::countInliers(MotionHypothesis& found) {
  PoseEvidence& evidence = found.evidence;
  evidence.inliers = static_cast<int>(found.motion.inliers.size());
  evidence.lasting_inliers = found.lastingInliers();
  evidence.motion = found.motion.T_current_reference.inverse();
}

/// Aligns the inliers' patches and refines the motion on them.
MotionSearch::Alignment MotionSearch::align(const MotionScene& scene, const MotionHypothesis& found) const {
  constexpr std::size_t kEnough = 30;  // fewer are no better than all corners together
  const StereoFeatures& features = scene.features;
  const Eigen::Isometry3d T_camera_origin = found.motion.T_current_reference * scene.map.newestPose();
  Alignment alignment{found.motion.T_current_reference, {}, {}};
  std::vector<Correspondence> aligned;
  for (auto* correspondences : {&alignment.measured, &aligned}) correspondences->reserve(found.motion.inliers.size());
  alignment.sightings.reserve(found.motion.inliers.size());
  for (const int i : found.motion.inliers) {
    const FeatureMatch& match = found.matches[i];
    const LocalMap::Sighting sighting = scene.map.sight(alignment_options_, features, T_camera_origin,
                                                        found.view->point[match.reference], match.current);
    alignment.sightings.push_back(sighting);
    alignment.measured.push_back(found.correspondences[i]);
    if (!sighting.aligned) continue;
    const Eigen::Vector2d corner(features.u[match.current], features.v[match.current]);
    alignment.measured.back().measurement =
        measurementOf(features, match.current, scene.calibration, sighting.measurement.head<2>() - corner);
    aligned.push_back(alignment.measured.back());
  }
  if (aligned.size() >= kEnough) refineMotion(features.camera, motion_options_, aligned, alignment.T_current_reference);
  return alignment;
}

/// The motion that the points which stood still so far tell when left alone, if it is another than that of all
/// together: one that puts most of the others elsewhere, and that is not within their own error. Far points agree with
/// nearly any step once a turn makes up for it, so their number says nothing.
std::optional<Eigen::Isometry3d> MotionSearch::motionOfLasting(const StereoCamera& camera,
                                                               const MotionHypothesis& found, const Alignment& aligned,
                                                               double significant) const {
  std::vector<Correspondence> lasting, others;
  lasting.reserve(aligned.measured.size()), others.reserve(aligned.measured.size());
  for (std::size_t k = 0; k < aligned.measured.size(); ++k)
    (found.isLasting(found.motion.inliers[k]) ? lasting : others).push_back(aligned.measured[k]);
  if (static_cast<int>(lasting.size()) < kEnoughLasting || static_cast<int>(others.size()) < kEnoughLasting)
    return std::nullopt;

  const Eigen::Isometry3d& T = aligned.T_current_reference;
  Eigen::Isometry3d T_lasting = T;
  const NormalEquations equations = refineMotion(camera, motion_options_, lasting, T_lasting);
  std::vector<int> all(others.size());
  std::iota(all.begin(), all.end(), 0);
  if (agree(camera, others, all, T, T_lasting, kElsewhere)) return std::nullopt;
  const Vector6d difference = logSE3(T_lasting * T.inverse());
  const double least = std::max(significant, kCertainOfOne * static_cast<double>(lasting.size()));
  if (difference.dot(equations.hessian * difference) <= least * equations.variance()) return std::nullopt;
  return T_lasting;
}

/// Something that moves by less than what corners may err by is among the inliers of every hypothesis and draws them
/// all away. Aligned positions tell it from the points that stood still so far.
void MotionSearch::keepTo(const MotionScene& scene, const Eigen::Isometry3d& T_lasting,
                          const std::vector<Correspondence>& measured, MotionHypothesis& found) const {
  MotionEstimate& motion = found.motion;
  std::vector<int> inliers;
  std::vector<LocalMap::Sighting> sightings;
  for (const int k : PoseProblem(scene.features.camera, measured, kElsewhere).inliers(T_lasting)) {
    inliers.push_back(motion.inliers[k]);
    sightings.push_back(found.sightings[k]);
  }
  // The other motion explains the rest, so that does not speak against this one.
  found.evidence.matches -= static_cast<int>(motion.inliers.size() - inliers.size());
  if (!found.rival) found.rival = motion.T_current_reference;
  motion.T_current_reference = T_lasting;
  motion.inliers = std::move(inliers);
  found.sightings = std::move(sightings);
  countInliers(found);
  found.contested = true;
  found.verdict = {Trust::kDoubtful, "points that stood still so far show another motion than all " +
                                         std::to_string(measured.size()) +
                                         " inliers: does something move in front of the camera?"};
}

}  // namespace sdvo
