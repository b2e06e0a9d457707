#pragma once

#include <Eigen/Geometry>
#include <string>

#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/matching/view_matcher.hpp"

namespace sdvo {

/// Result of the geometric check of two pairs.
struct PlaceMatch {
  bool same = false;                                                 ///< both show the same place
  std::string reason;                                                ///< why not
  Eigen::Isometry3d T_place_camera = Eigen::Isometry3d::Identity();  ///< pose of the newer pair
  Matrix6d covariance = Matrix6d::Zero();                            ///< of its right perturbation, m and rad
  int matches = 0, inliers = 0;
  double coverage = 0.0;  ///< by the inliers, share of an 8x4 grid
  double rms = 0.0;       ///< px per coordinate
};

/// Decides by geometry alone whether two stereo pairs show the same place: match, consensus, refinement.
class PlaceVerifier {
 public:
  static constexpr int kLeastInliers = 40;  ///< fewer are not the same place

  PlaceVerifier();

  PlaceMatch verify(const StereoFeatures& place, const StereoFeatures& current) const;

 private:
  ViewMatcher views_;
};

}  // namespace sdvo
