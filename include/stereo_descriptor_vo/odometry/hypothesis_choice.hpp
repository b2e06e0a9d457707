#pragma once

#include <cstddef>
#include <vector>

#include "stereo_descriptor_vo/odometry/motion_hypothesis.hpp"
#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"

namespace sdvo {

/// Chooses among the hypotheses of one pair's motion, and says what the others mean for the chosen one.
class HypothesisChoice {
 public:
  /// `min_inliers`: fewer are no motion.
  HypothesisChoice(const PoseVerdictOptions& options, int min_inliers) : options_(options), min_inliers_(min_inliers) {}

  /// One hypothesis at least. The one that is returned has the verdict, the rival and the times of all.
  MotionHypothesis choose(const MotionScene& scene, std::vector<MotionHypothesis> hypotheses) const;

 private:
  std::vector<double> lastingCosts(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const;
  std::size_t best(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const;
  int leastOfRival(const MotionEstimate& motion) const;

  PoseVerdictOptions options_;
  int min_inliers_;
};

}  // namespace sdvo
