#pragma once

#include <Eigen/Geometry>
#include <string>

#include "stereo_descriptor_vo/common/options.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/view_matcher.hpp"

namespace sdvo {

struct PlaceVerifierOptions {
  double max_distance = 0.3;
  double inlier_threshold = 3.0;
  int min_inliers = 40;
  double min_inlier_ratio = 0.3;
  double min_coverage = 0.25;
  double max_rms = 1.5;

  void describe(OptionList& list) {
    list.add("max_distance", max_distance, {0.01, 1.0}, "",
             "largest distance of matched descriptors: share of their bits");
    list.add("inlier_threshold", inlier_threshold, {0.1, 50.0}, "px", "largest residual of an inlier");
    list.add("min_inliers", min_inliers, {12, 10000}, "", "fewer are not the same place");
    list.add("min_inlier_ratio", min_inlier_ratio, {0.0, 1.0}, "", "inliers per match; less is not the same place");
    list.add("min_coverage", min_coverage, {0.0, 1.0}, "",
             "share of an 8x4 grid over the image that the inliers must fill");
    list.add("max_rms", max_rms, {0.01, 50.0}, "px",
             "larger residuals of the inliers, per coordinate, are not the same place");
  }
};

/// What geometry says of two pairs that look alike.
struct PlaceMatch {
  bool same = false;                                                 ///< both show the same place
  std::string reason;                                                ///< why not
  Eigen::Isometry3d T_place_camera = Eigen::Isometry3d::Identity();  ///< where the newer pair was seen from
  Matrix6d covariance = Matrix6d::Zero();                            ///< of its right perturbation, m and rad
  int matches = 0, inliers = 0;
  double coverage = 0.0;  ///< by the inliers, share of an 8x4 grid
  double rms = 0.0;       ///< px per coordinate
};

/// Decides by geometry alone whether two stereo pairs show the same place: match, consensus, refinement.
class PlaceVerifier {
 public:
  explicit PlaceVerifier(const PlaceVerifierOptions& options);

  PlaceMatch verify(const StereoFeatures& place, const StereoFeatures& current) const;

 private:
  PlaceVerifierOptions options_;
  ViewMatcher views_;
};

}  // namespace sdvo
