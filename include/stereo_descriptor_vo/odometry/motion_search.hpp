#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/odometry/feature_matcher.hpp"
#include "stereo_descriptor_vo/odometry/local_map.hpp"
#include "stereo_descriptor_vo/odometry/motion_estimator.hpp"
#include "stereo_descriptor_vo/odometry/patch_alignment.hpp"
#include "stereo_descriptor_vo/odometry/pose_verdict.hpp"
#include "stereo_descriptor_vo/odometry/rig_calibration.hpp"

namespace sdvo {

/// What a pair's motion is looked for in. The references must outlive it.
struct MotionScene {
  const LocalMap& map;
  const RigCalibration& calibration;
  const StereoFeatures& features;
  std::optional<Eigen::Isometry3d> T_current_reference;  ///< as expected, since the map's newest pair
  std::optional<Vector6d> velocity;                      ///< of the camera before, m/s and rad/s
  bool contested = false;                                ///< a moment ago something else moved in view
  double velocity_age = 0.0;                             ///< of that at the map's newest pair, s
  std::optional<Eigen::Isometry3d> guess;                ///< T_current_reference as something else than images has it
};

/// One answer to where a pair is, and what speaks for it.
struct MotionHypothesis {
  PoseEvidence evidence;
  PoseVerdict verdict;
  MotionEstimate motion;                       ///< since the map's newest pair
  std::optional<Eigen::Isometry3d> rival;      ///< T_current_reference of a hypothesis that could not be rejected
  bool guided = false;                         ///< found with a prior
  bool contested = false;                      ///< by a motion of something else in view
  std::shared_ptr<const LocalMap::View> view;  ///< of the map; one for all hypotheses of a pair
  std::vector<FeatureMatch> matches;           ///< rows of the view to rows of the pair
  std::vector<Correspondence> correspondences;
  std::vector<LocalMap::Sighting> sightings;   ///< of the motion's inliers
  double match_time = 0.0, motion_time = 0.0;  ///< s

  /// Whether a match is one of a point that stood still in several pairs.
  bool isLasting(int match) const;

  /// Rows of the pair that the inliers matched, but for the rejected ones.
  std::vector<int> inlierRows(const std::vector<int>& rejected = {}) const;

  /// How many of those are of lasting points.
  int lastingInliers(const std::vector<int>& rejected = {}) const;
};

/// Share of an 8x4 grid's cells over the image that hold one of the pair's rows.
double coverage(const StereoFeatures& features, const std::vector<int>& rows);

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
  void countInliers(const MotionScene& scene, MotionHypothesis& found) const;
  Alignment align(const MotionScene& scene, const MotionHypothesis& found) const;
  std::optional<Eigen::Isometry3d> motionOfLasting(const StereoCamera& camera, const MotionHypothesis& found,
                                                   const Alignment& aligned, double significant) const;
  void keepTo(const MotionScene& scene, const Eigen::Isometry3d& T_lasting, const std::vector<Correspondence>& measured,
              MotionHypothesis& found) const;
  MotionHypothesis choose(const MotionScene& scene, std::vector<MotionHypothesis> hypotheses) const;
  std::vector<double> lastingCosts(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const;
  std::size_t best(const MotionScene& scene, const std::vector<MotionHypothesis>& hypotheses) const;
  int leastOfRival(const MotionEstimate& motion) const;

  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  PoseVerdictOptions verdict_options_;
  FeatureMatcher matcher_, wide_matcher_;
  MotionEstimator estimator_;
};

}  // namespace sdvo
