#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "motion_hypotheses.hpp"
#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/matching/feature_matcher.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/motion/motion_estimator.hpp"

namespace sdvo {

/// Finds the motion of a pair since the map's newest pair among hypotheses. The first one rests on the guess, else on
/// the prediction. Unless it is beyond doubt, others compete: the prediction's, one without a prediction, one of the
/// lasting points, and those of the outliers, which may be of a mover.
class MotionSearch {
 public:
  MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
               const PatchAlignmentOptions& alignment);

  /// `max_doubt`: log-odds of being misled up to which a motion that the majority agrees with is taken at once.
  MotionHypothesis find(const MotionScene& scene, double max_doubt) const;

  /// Whether no other hypothesis needs to compete with it.
  bool isBeyondDoubt(const MotionScene& scene, const MotionHypothesis& found, double max_doubt) const;

  /// In words, if there are too few inliers for a motion, or as many as chance gives.
  std::string chanceWords(const MotionScene& scene, const MotionHypothesis& found) const;

 private:
  /// With the noise that was learnt of the rig.
  MotionEstimatorOptions options(const MotionScene& scene) const;

  using ViewPtr = std::shared_ptr<const LocalMap::View>;

  /// A hypothesis' inliers as their patches have them, and the motion refined on these.
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
  void weigh(const MotionScene& scene, MotionHypothesis& found) const;
  Alignment align(const MotionScene& scene, const MotionHypothesis& found) const;
  std::optional<Eigen::Isometry3d> motionOfLasting(const MotionScene& scene, const Alignment& aligned,
                                                   MotionHypothesis& found) const;
  void keepTo(const MotionScene& scene, const Eigen::Isometry3d& T_lasting, const std::vector<Correspondence>& measured,
              MotionHypothesis& found) const;

  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  FeatureMatcher matcher_, wide_matcher_;
  MotionEstimator estimator_;
};

}  // namespace sdvo
