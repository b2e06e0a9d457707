#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "../belief/motion_hypotheses.hpp"
#include "../common/text.hpp"
#include "../matching/view_matcher.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/places/place.hpp"

namespace sdvo {

/// Decides by geometry alone whether two stereo pairs show the same place: match, consensus, refinement.
class PlaceVerifier {
 public:
  static constexpr int kLeastInliers = 40;  ///< fewer are not the same place

  PlaceVerifier() : views_(estimatorOptions()) {}

  PlaceMatch verify(const StereoFeatures& place, const StereoFeatures& current) const {
    // The disparity error of the rig is in both pairs alike.
    const auto [matches, correspondences, motion] = views_.match(place, current, RigCalibration());
    PlaceMatch match;
    match.matches = static_cast<int>(matches.size());
    if (match.matches < kLeastInliers) {
      match.reason = text(0, "only ", match.matches, " matches");
      return match;
    }
    if (!motion.success) {
      match.reason = motion.reason;
      return match;
    }
    std::vector<int> indices;
    for (const int i : motion.inliers) indices.push_back(matches[i].current);
    match.inliers = static_cast<int>(indices.size());
    match.coverage = coverage(current, indices);
    match.rms = motion.rms;
    // The inverse of exp(xi) T_camera_place is T_place_camera exp(-xi), so the covariance stays. It is doubled because
    // the motion's takes the place's points for exact, which err as much as the current ones.
    match.T_place_camera = motion.T_current_reference.inverse();
    match.covariance = 2.0 * motion.covariance;

    const std::string inliers = text(0, match.inliers, " of ", match.matches, " matches");
    if (match.inliers < kLeastInliers || match.inliers < kLeastRatio * match.matches)
      match.reason = "only " + inliers + " agree";
    else if (match.coverage < kLeastCoverage)
      match.reason = inliers + " agree, but only in a small part of the image";
    match.same = match.reason.empty();
    return match;
  }

 private:
  // Thresholds of the same place (chosen).
  static constexpr double kLeastRatio = 0.3;      // inliers per match
  static constexpr double kLeastCoverage = 0.25;  // by inliers, share of an 8x4 grid over the image

  static MotionEstimatorOptions estimatorOptions() {
    MotionEstimatorOptions estimator;
    estimator.inlier_threshold = 3.0;  // px (chosen)
    // Enough to find 30 % inliers with a probability of 98 %. A candidate that shows another place takes all of them.
    estimator.max_iterations = 150;
    return estimator;
  }

  ViewMatcher views_;
};

}  // namespace sdvo
