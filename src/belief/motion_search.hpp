#pragma once

#include "../motion/motion_estimator.hpp"
#include "motion_hypotheses.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// Finds the motion of a pair since the map's newest pair (reference). The first hypothesis is searched near the guess,
/// else near the prediction. Unless isBeyondDoubt(), others compete: near the prediction, without prediction, of the
/// lasting points, and of the outliers, which may be a mover's.
class MotionSearch {
 public:
  explicit MotionSearch(const MotionEstimatorOptions& motion);

  /// `max_doubt`: log-odds that a motion is not the camera's, up to which a majority's motion needs no competition.
  MotionHypothesis find(const MotionScene& scene, double max_doubt) const;

  /// Whether no other hypothesis needs to compete with this one.
  bool isBeyondDoubt(const MotionHypothesis& found, double max_doubt) const;

  /// Reason, if there are too few inliers, or as many as chance gives; else empty.
  std::string chanceWords(const MotionScene& scene, const MotionHypothesis& found) const;

 private:
  class OnePair;

  MotionEstimatorOptions options_;
  FeatureMatcher matcher_, wide_matcher_{FeatureMatcherOptions::wide()};
  MotionEstimator estimator_;
};

}  // namespace sdvo
