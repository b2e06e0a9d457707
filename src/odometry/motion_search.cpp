#include "stereo_descriptor_vo/odometry/motion_search.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "stereo_descriptor_vo/common/stopwatch.hpp"
#include "stereo_descriptor_vo/odometry/correspondences.hpp"
#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

namespace sdvo {
namespace {

constexpr double kElsewhere = 0.6;  // px, of aligned positions; up to 0.5 where nothing moved
// Chi-square of six, by which it is worth to look further, and to follow few points rather than all. Errors of
// neighbouring points are not independent: up to 170 where nothing moved.
constexpr double kSuspicious = 100.0, kCertain = 200.0;

bool contains(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

/// What is among the first but not among the second; both ascend.
std::vector<int> without(const std::vector<int>& first, const std::vector<int>& second) {
  std::vector<int> rest;
  std::set_difference(first.begin(), first.end(), second.begin(), second.end(), std::back_inserter(rest));
  return rest;
}

std::vector<int> sorted(std::vector<int> values) {
  std::sort(values.begin(), values.end());
  return values;
}

/// Whether two hypotheses mean one motion, for what the one explains and for what the other does: far points alone do
/// not tell a turn from a step.
bool areOne(const StereoCamera& camera, const MotionHypothesis& a, const MotionHypothesis& b) {
  if (!a.motion.success || !b.motion.success) return false;
  const Eigen::Isometry3d &T_a = a.motion.T_current_reference, &T_b = b.motion.T_current_reference;
  return agree(camera, a.correspondences, a.motion.inliers, T_a, T_b) &&
         agree(camera, b.correspondences, b.motion.inliers, T_a, T_b);
}

}  // namespace

bool MotionHypothesis::isLasting(int match) const {
  constexpr int kPairs = 4;
  return view->seen[matches[match].reference] >= kPairs;
}

std::vector<int> MotionHypothesis::inlierRows(const std::vector<int>& rejected) const {
  std::vector<int> rows;
  rows.reserve(motion.inliers.size());
  for (const int i : motion.inliers)
    if (!contains(rejected, matches[i].current)) rows.push_back(matches[i].current);
  return rows;
}

int MotionHypothesis::lastingInliers(const std::vector<int>& rejected) const {
  return static_cast<int>(std::count_if(motion.inliers.begin(), motion.inliers.end(), [&](int i) {
    return isLasting(i) && !contains(rejected, matches[i].current);
  }));
}

double coverage(const StereoFeatures& features, const std::vector<int>& rows) {
  constexpr int kColumns = 8, kRows = 4;
  std::bitset<kColumns * kRows> cells;
  for (const int i : rows) {
    const int column = static_cast<int>(features.u[i] * kColumns / features.camera.width);
    const int row = static_cast<int>(features.v[i] * kRows / features.camera.height);
    cells.set(static_cast<std::size_t>(std::clamp(row, 0, kRows - 1) * kColumns + std::clamp(column, 0, kColumns - 1)));
  }
  return static_cast<double>(cells.count()) / (kColumns * kRows);
}

MotionSearch::MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
                           const PatchAlignmentOptions& alignment, const PoseVerdictOptions& verdict)
    : motion_options_(motion),
      alignment_options_(alignment),
      verdict_options_(verdict),
      matcher_(matcher),
      wide_matcher_(matcher.widened()),
      estimator_(motion) {}

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
  if (prior) {
    hypotheses.push_back(searchAmong(scene, all, agreeing(scene, all, *prior)));
    hypotheses.back().guided = true;
  }
  // What moves by itself may have left copies of itself in the map, each with a motion of its own.
  constexpr int kMotions = 4;
  MotionEstimate peeled = all.motion;
  for (int k = 0; k < kMotions && (k == 0 || peeled.success); ++k) {
    rest = without(rest, peeled.inliers);
    hypotheses.push_back(searchAmong(scene, all, rest));
    peeled = hypotheses.back().motion;
  }
  found = choose(scene, std::move(hypotheses));
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
  found.guided = T_current_reference.has_value();
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
  countInliers(scene, found);
  evidence.rms = found.motion.rms;
  evidence.covariance = found.motion.covariance;
  evidence.dt = static_cast<double>(scene.features.stamp - scene.map.newestStamp()) * 1e-9;
  evidence.velocity = scene.velocity;
  evidence.velocity_age = scene.velocity_age;
  if (scene.guess) evidence.guess = scene.guess->inverse();
  found.verdict = found.motion.success ? judgePose(verdict_options_, motion_options_.min_inliers, evidence)
                                       : PoseVerdict{Trust::kNone, found.motion.reason};
}

void MotionSearch::countInliers(const MotionScene& scene, MotionHypothesis& found) const {
  PoseEvidence& evidence = found.evidence;
  evidence.inliers = static_cast<int>(found.motion.inliers.size());
  evidence.lasting_inliers = found.lastingInliers();
  evidence.coverage = coverage(scene.features, found.inlierRows());
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
  if (difference.dot(equations.hessian * difference) <= significant * equations.variance()) return std::nullopt;
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
  countInliers(scene, found);
  found.contested = true;
  found.verdict = {Trust::kDoubtful, "points that stood still so far show another motion than all " +
                                         std::to_string(measured.size()) +
                                         " inliers: does something move in front of the camera?"};
}

/// Half the squared residuals, in standard deviations, of the matches of lasting points under each hypothesis,
/// whichever hypothesis matched them: the smaller, the likelier.
std::vector<double> MotionSearch::lastingCosts(const MotionScene& scene,
                                               const std::vector<MotionHypothesis>& hypotheses) const {
  constexpr double kSigma = 0.7;    // px, of a corner and of the map's point
  constexpr double kOutlier = 3.0;  // sigma
  std::set<std::pair<int, int>> seen;
  std::vector<Correspondence> lasting;
  for (const MotionHypothesis& hypothesis : hypotheses)
    for (int i = 0; i < static_cast<int>(hypothesis.matches.size()); ++i)
      if (hypothesis.isLasting(i) &&
          seen.emplace(hypothesis.matches[i].reference, hypothesis.matches[i].current).second)
        lasting.push_back(hypothesis.correspondences[i]);
  const PoseProblem problem(scene.features.camera, lasting, kOutlier * kSigma);
  std::vector<double> costs;
  for (const MotionHypothesis& hypothesis : hypotheses)
    costs.push_back(0.5 / (kSigma * kSigma) * problem.truncatedCost(hypothesis.motion.T_current_reference));
  return costs;
}

/// The hypothesis that the lasting points speak for, for they stood still so far; where they do not tell, the one that
/// goes on as before.
std::size_t MotionSearch::best(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const {
  constexpr double kDecisive = 20.0;  // logarithm of the ratio of the likelihoods: some five points
  const std::vector<double> lasting_costs = lastingCosts(scene, hypotheses);
  const auto areSame = [&](const MotionHypothesis& a, const MotionHypothesis& b) {
    return areOne(scene.map.camera(), a, b);
  };
  const auto change = [&](const MotionHypothesis& of) {
    return (expSE3(*scene.velocity * -of.evidence.dt) * of.evidence.motion).translation().norm();
  };
  // Each step keeps some of those that are left, whatever their order.
  std::vector<std::size_t> left;
  const auto keep = [&](const auto& isKept) {
    std::vector<std::size_t> kept;
    std::copy_if(left.begin(), left.end(), std::back_inserter(kept), isKept);
    if (!kept.empty()) left = std::move(kept);
  };
  const auto inliers = [&](std::size_t k) { return hypotheses[k].evidence.inliers; };
  left.resize(hypotheses.size());
  std::iota(left.begin(), left.end(), std::size_t{0});
  keep([&](std::size_t k) { return hypotheses[k].motion.success; });
  const auto by_cost = [&](std::size_t a, std::size_t b) { return lasting_costs[a] < lasting_costs[b]; };
  const double least_cost = lasting_costs[*std::min_element(left.begin(), left.end(), by_cost)];
  keep([&](std::size_t k) { return lasting_costs[k] <= least_cost + kDecisive; });
  // However many they are: a board that covers most of the view outnumbers what is left of the world.
  keep([&](std::size_t k) { return !isImplausible(verdict_options_, hypotheses[k].evidence); });
  const auto by_inliers = [&](std::size_t a, std::size_t b) { return inliers(a) < inliers(b); };
  const std::size_t largest = *std::max_element(left.begin(), left.end(), by_inliers);
  if (scene.velocity) {
    keep([&](std::size_t k) { return k == largest || inliers(k) > leastOfRival(hypotheses[largest].motion); });
    const auto by_change = [&](std::size_t a, std::size_t b) { return change(hypotheses[a]) < change(hypotheses[b]); };
    const std::size_t steadiest = *std::min_element(left.begin(), left.end(), by_change);
    keep([&](std::size_t k) { return k == steadiest || areSame(hypotheses[k], hypotheses[steadiest]); });
  }
  // Of one motion the first that is sound will do.
  const auto sound = std::find_if(left.begin(), left.end(),
                                  [&](std::size_t k) { return hypotheses[k].verdict.trust == Trust::kSound; });
  return sound != left.end() ? *sound : *std::max_element(left.begin(), left.end(), by_inliers);
}

/// Takes the best hypothesis. What the others say confirms it or speaks against it.
MotionHypothesis MotionSearch::choose(const MotionScene& scene, std::vector<MotionHypothesis> hypotheses) const {
  MotionHypothesis& chosen = hypotheses[best(scene, hypotheses)];
  double match_time = 0.0, motion_time = 0.0;
  for (const MotionHypothesis& hypothesis : hypotheses)
    match_time += hypothesis.match_time, motion_time += hypothesis.motion_time;
  chosen.match_time = match_time;
  chosen.motion_time = motion_time;
  if (!chosen.motion.success) return std::move(chosen);

  const MotionHypothesis* rival = nullptr;
  std::vector<int> of_rival, of_rivals;  // rows that the largest rival, or any, explains and the chosen one does not
  const std::vector<int> own = sorted(chosen.inlierRows());
  for (const MotionHypothesis& other : hypotheses) {
    if (&other == &chosen || !other.motion.success) continue;
    if (areOne(scene.map.camera(), chosen, other)) {
      chosen.evidence.confirmed |= chosen.guided != other.guided;  // from matches of their own
      continue;
    }
    std::vector<int> rows = without(sorted(other.inlierRows()), own);
    if (static_cast<int>(rows.size()) < leastOfRival(chosen.motion)) continue;
    std::vector<int> both;
    std::set_union(of_rivals.begin(), of_rivals.end(), rows.begin(), rows.end(), std::back_inserter(both));
    of_rivals = std::move(both);
    if (rows.size() > of_rival.size()) rival = &other, of_rival = std::move(rows);
  }
  // What rivals explain does not speak against the chosen one.
  chosen.evidence.matches -=
      static_cast<int>(std::count_if(chosen.matches.begin(), chosen.matches.end(), [&](const FeatureMatch& match) {
        return std::binary_search(of_rivals.begin(), of_rivals.end(), match.current);
      }));
  chosen.verdict = judgePose(verdict_options_, motion_options_.min_inliers, chosen.evidence);
  constexpr double kSubstantial = 0.35;  // ratio (chosen): less is a small mover or repeated texture
  const bool substantial = static_cast<double>(of_rival.size()) >= kSubstantial * chosen.evidence.inliers;
  chosen.contested = lastingDisagree(verdict_options_, chosen.evidence);
  if (rival && (substantial ? chosen.verdict.trust != Trust::kNone : chosen.verdict.trust == Trust::kDoubtful)) {
    chosen.contested = true;
    chosen.rival = rival->motion.T_current_reference;
    chosen.verdict = {Trust::kDoubtful, "two motions in view, of " + std::to_string(own.size()) + " and " +
                                            std::to_string(of_rival.size()) +
                                            " matches: does something move in front of the camera?"};
  }
  // Rather what was expected than the motion of something that has come to cover most of the view.
  if (scene.contested && scene.T_current_reference && isImplausible(verdict_options_, chosen.evidence)) {
    chosen.verdict = {Trust::kNone, judgeChange(verdict_options_, chosen.evidence).reason +
                                        ", right after something else moved in view"};
  }
  return std::move(chosen);
}

/// Fewer inliers than that are no rival of a motion.
int MotionSearch::leastOfRival(const MotionEstimate& motion) const {
  constexpr double kLeast = 0.1;
  return std::max(2 * motion_options_.min_inliers,
                  static_cast<int>(kLeast * static_cast<double>(motion.inliers.size())));
}

}  // namespace sdvo
