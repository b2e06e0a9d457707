#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "../map/local_map.hpp"
#include "../matching/patch_alignment.hpp"
#include "../motion/motion_estimator.hpp"
#include "motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"

namespace sdvo {

/// Finds the motion of a pair since the map's newest pair (reference). The first hypothesis is searched near the guess,
/// else near the prediction. Unless isBeyondDoubt(), others compete: near the prediction, without prediction, of the
/// lasting points, and of the outliers, which may be a mover's.
class MotionSearch {
 public:
  MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
               const PatchAlignmentOptions& alignment);

  /// `max_doubt`: log-odds that a motion is not the camera's, up to which a majority's motion needs no competition.
  MotionHypothesis find(const MotionScene& scene, double max_doubt) const;

  /// Whether no other hypothesis needs to compete with this one.
  bool isBeyondDoubt(const MotionHypothesis& found, double max_doubt) const;

  /// Reason, if there are too few inliers, or as many as chance gives; else empty.
  std::string chanceWords(const MotionScene& scene, const MotionHypothesis& found) const;

 private:
  /// Motion options at this rig's learnt noise.
  MotionEstimatorOptions options(const MotionScene& scene) const;

  using ViewPtr = std::shared_ptr<const LocalMap::View>;

  /// A hypothesis' inliers at the positions of their aligned patches, and the motion refined on these.
  struct Alignment {
    Eigen::Isometry3d T_current_reference;
    std::vector<LocalMap::Sighting> sightings;
    std::vector<Correspondence> measured;
  };

  std::vector<MotionHypothesis> compete(const MotionScene& scene, const ViewPtr& view, MotionHypothesis first) const;
  MotionHypothesis searchNear(const MotionScene& scene, const ViewPtr& view,
                              const std::optional<Eigen::Isometry3d>& T_current_reference, double max_doubt) const;
  MotionHypothesis search(const FeatureMatcher& matcher, const MotionScene& scene, const ViewPtr& view,
                          const std::optional<Eigen::Isometry3d>& T_current_reference) const;
  bool leavesGate(const MotionScene& scene, const Eigen::Isometry3d& predicted, const MotionHypothesis& found) const;
  MotionHypothesis searchAmong(const MotionScene& scene, const MotionHypothesis& all,
                               const std::vector<int>& subset) const;
  std::vector<int> agreeing(const MotionScene& scene, const MotionHypothesis& all,
                            const Eigen::Isometry3d& T_current_reference) const;
  void assess(const MotionScene& scene, MotionHypothesis& found) const;
  bool refineByPatches(const MotionScene& scene, bool may_change, MotionHypothesis& found) const;
  Alignment align(const MotionScene& scene, const MotionHypothesis& found) const;
  std::optional<Eigen::Isometry3d> motionOfLasting(const MotionScene& scene, const Alignment& aligned,
                                                   MotionHypothesis& found) const;
  void dropInliersOff(const MotionScene& scene, const Eigen::Isometry3d& T_lasting,
                      const std::vector<Correspondence>& measured, MotionHypothesis& found) const;

  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  FeatureMatcher matcher_, wide_matcher_;
  MotionEstimator estimator_;
};

}  // namespace sdvo
