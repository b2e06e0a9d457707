#include "stereo_descriptor_vo/odometry/hypothesis_choice.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "ascending_rows.hpp"
#include "stereo_descriptor_vo/odometry/pose_problem.hpp"
#include "stereo_descriptor_vo/odometry/rival_motion.hpp"

namespace sdvo {
namespace {

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

/// Half the squared residuals, in standard deviations, of the matches of lasting points under each hypothesis,
/// whichever hypothesis matched them: the smaller, the likelier.
std::vector<double> HypothesisChoice::lastingCosts(const MotionScene& scene,
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
std::size_t HypothesisChoice::best(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const {
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
  keep([&](std::size_t k) { return !isImplausible(options_, hypotheses[k].evidence); });
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

/// Takes the best hypothesis. The others may contradict it.
MotionHypothesis HypothesisChoice::choose(const MotionScene& scene, std::vector<MotionHypothesis> hypotheses) const {
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
    if (&other == &chosen || !other.motion.success || areOne(scene.map.camera(), chosen, other)) continue;
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
  chosen.verdict = judgePose(options_, min_inliers_, chosen.evidence);
  constexpr double kSubstantial = 0.35;  // ratio (chosen): less is a small mover or repeated texture
  const bool substantial = static_cast<double>(of_rival.size()) >= kSubstantial * chosen.evidence.inliers;
  chosen.contested = lastingDisagree(options_, chosen.evidence);
  if (rival && (substantial ? chosen.verdict.trust != Trust::kNone : chosen.verdict.trust == Trust::kDoubtful)) {
    chosen.contested = true;
    chosen.rival = rival->motion.T_current_reference;
    chosen.verdict = {Trust::kDoubtful, "two motions in view, of " + std::to_string(own.size()) + " and " +
                                            std::to_string(of_rival.size()) +
                                            " matches: does something move in front of the camera?"};
  }
  // Rather what was expected than the motion of something that has come to cover most of the view.
  if (scene.contested && scene.T_current_reference && isImplausible(options_, chosen.evidence)) {
    chosen.verdict = {Trust::kNone,
                      judgeChange(options_, chosen.evidence).reason + ", right after something else moved in view"};
  }
  return std::move(chosen);
}

/// Fewer inliers than that are no rival of a motion.
int HypothesisChoice::leastOfRival(const MotionEstimate& motion) const {
  constexpr double kLeast = 0.1;  // ratio of the inliers (chosen)
  return std::max(2 * min_inliers_, static_cast<int>(kLeast * static_cast<double>(motion.inliers.size())));
}

}  // namespace sdvo
