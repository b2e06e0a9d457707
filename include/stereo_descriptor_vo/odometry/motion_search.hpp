#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_camera.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/hypothesis_choice.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"
#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"
#include "stereo_descriptor_vo/odometry/motion_hypothesis.hpp"
#include "stereo_descriptor_vo/odometry/patch_alignment.hpp"
#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"

namespace sdvo {

/// Finds the motion of a pair since the map's newest pair among hypotheses. The first one rests on the guess, else on
/// the prediction. Where it is in doubt, others compete: the prediction's, one without a prediction, one of the lasting
/// points, and those of the outliers, which may be of a mover.
class MotionSearch {
 public:
  MotionSearch(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
               const PatchAlignmentOptions& alignment, const PoseVerdictOptions& verdict);

  MotionHypothesis find(const MotionScene& scene) const;

 private:
  using ViewPtr = std::shared_ptr<const LocalMap::View>;

  /// A hypothesis' inliers as their patches have them, and the motion refined on these.
  struct Alignment {
    Eigen::Isometry3d T_current_reference;
    std::vector<LocalMap::Sighting> sightings;
    std::vector<Correspondence> measured;
  };

  MotionHypothesis searchNear(const MotionScene& scene, const ViewPtr& view,
                              const std::optional<Eigen::Isometry3d>& T_current_reference) const;
  MotionHypothesis search(const FeatureMatcher& matcher, const MotionScene& scene, const ViewPtr& view,
                          const std::optional<Eigen::Isometry3d>& T_current_reference) const;
  bool leavesGate(const MotionScene& scene, const Eigen::Isometry3d& predicted, const MotionHypothesis& found) const;
  MotionHypothesis searchAmong(const MotionScene& scene, const MotionHypothesis& all,
                               const std::vector<int>& subset) const;
  std::vector<int> agreeing(const MotionScene& scene, const MotionHypothesis& all,
                            const Eigen::Isometry3d& T_current_reference) const;
  void weigh(const MotionScene& scene, MotionHypothesis& found) const;
  static void countInliers(MotionHypothesis& found);
  Alignment align(const MotionScene& scene, const MotionHypothesis& found) const;
  std::optional<Eigen::Isometry3d> motionOfLasting(const StereoCamera& camera, const MotionHypothesis& found,
                                                   const Alignment& aligned, double significant) const;
  void keepTo(const MotionScene& scene, const Eigen::Isometry3d& T_lasting, const std::vector<Correspondence>& measured,
              MotionHypothesis& found) const;

  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  PoseVerdictOptions verdict_options_;
  FeatureMatcher matcher_, wide_matcher_;
  MotionEstimator estimator_;
  HypothesisChoice choice_;
};

}  // namespace sdvo
