#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/map/local_map.hpp"
#include "stereo_descriptor_vo/matching/patch_alignment.hpp"
#include "stereo_descriptor_vo/matching/view_matcher.hpp"
#include "stereo_descriptor_vo/motion/rig_calibration.hpp"

namespace sdvo {

/// A point of a map in the image of a pair that may see it.
struct ExpectedPoint {
  Eigen::Vector2d pixel;  ///< in the left image, px
  bool found;             ///< in the pair, at that place
};

/// Probability that a pair which shows another place finds as many of a map's points as this. Matches of another place
/// agree on no motion, so chance is no danger. A thing that stands in both places is one (a poster, a chair, a part of
/// the robot), but it fills a part of the view only. Hence the view is divided into parts with equally many expected
/// points each. There are so many parts that three of the points found fall into each if they are spread evenly. In
/// another place a part holds any with a probability of one half at most.
double chanceOfAnotherPlace(std::vector<ExpectedPoint> points);

/// Where a map shows what a pair sees.
struct FoundPlace {
  Eigen::Isometry3d T_current_newest;      ///< the motion since the map's newest pair
  double chance;                           ///< that the pair shows another place
  std::optional<Eigen::Isometry3d> alike;  ///< the same by other points of the map, where these show as much
};

/// Finds a pair in the map from before an outage, wherever the camera went meanwhile.
class Reacquisition {
 public:
  Reacquisition(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion);

  /// Nothing where the pair does not show the map's place.
  std::optional<FoundPlace> find(const LocalMap& map, const StereoFeatures& features,
                                 const RigCalibration& calibration) const;

 private:
  struct Match {
    ViewMatch view;
    double chance;
  };
  std::optional<Match> match(const DescribedPoints& seen_again, const DescribedPoints& points,
                             const StereoFeatures& features, const RigCalibration& calibration) const;

  ViewMatcher anywhere_, near_;
};

/// Links the map's newest pair to a remembered key frame of the same place, so that drift since then is taken back.
class Revisit {
 public:
  Revisit(const FeatureMatcherOptions& matcher, const MotionEstimatorOptions& motion,
          const PatchAlignmentOptions& alignment);

  /// Recalls the key frame whose place the newest pair has come back to. Returns whether there was one that enough
  /// aligned points confirm. The map is as before otherwise.
  bool recall(const StereoFeatures& features, const RigCalibration& calibration, LocalMap& map) const;

 private:
  MotionEstimatorOptions motion_options_;
  PatchAlignmentOptions alignment_options_;
  ViewMatcher views_;
};

}  // namespace sdvo
