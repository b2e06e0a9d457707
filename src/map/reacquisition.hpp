#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "../matching/view_matcher.hpp"
#include "../motion/rig_calibration.hpp"
#include "local_map.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

namespace sdvo {

/// A point of a map, projected into a pair in which it should be seen.
struct ExpectedPoint {
  Eigen::Vector2d pixel;  ///< in the left image, px
  bool found;             ///< a feature of the pair was matched with it there
};

/// Probability that a pair of another place matches the map at least as widely as this one. Chance matches agree on no
/// motion, but an object that is in both places (a poster, a chair, a part of the robot) does. It fills only a part of
/// the view. Hence the view is divided into parts with equally many expected points, one part for three points found.
/// The test counts the parts with a point found. In another place each part has one with a probability of one half at
/// most.
double chanceOfAnotherPlace(std::vector<ExpectedPoint> points);

/// Pose of a pair relative to the map in which it was recognised.
struct FoundPlace {
  Eigen::Isometry3d T_current_newest;      ///< the motion since the map's newest pair
  double chance;                           ///< probability that the pair shows another place
  std::optional<Eigen::Isometry3d> alike;  ///< a second such motion, found with the other points: a repeated structure
};

/// Recognises the map from before an outage in a pair, without any guess of the motion meanwhile.
class Reacquisition {
 public:
  explicit Reacquisition(const MotionEstimatorOptions& motion);

  /// Nothing if the pair does not show the map's place.
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

/// Links the map's newest pair to a remembered key frame of the same place, which removes the drift since then.
class Revisit {
 public:
  explicit Revisit(const MotionEstimatorOptions& motion);

  /// Recalls the key frame to whose place the newest pair has come back, if enough aligned points confirm it. Returns
  /// whether it did; if not, the map is unchanged.
  bool recall(const StereoFeatures& features, const RigCalibration& calibration, LocalMap& map) const;

 private:
  MotionEstimatorOptions motion_options_;
  ViewMatcher views_;
};

}  // namespace sdvo
