#pragma once

#include <Eigen/Geometry>
#include <string>

#include "../matching/view_matcher.hpp"
#include "stereo_descriptor_vo/common/se3.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"
#include "stereo_descriptor_vo/places/place.hpp"

namespace sdvo {

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
